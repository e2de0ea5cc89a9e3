from .proof import logged as logged, lone as lone, proved_fate as proved_fate
