from .proof import (
    Leaping as Leaping,
    logged as logged,
    lone as lone,
    obstacle as obstacle,
    proved_fate as proved_fate,
)
