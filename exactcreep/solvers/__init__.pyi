from .exact.solver import Exact as Exact
from .field.certified import Certified as Certified
from .settling import SettlingSearch as SettlingSearch
from .sliding import Sliding as Sliding
from .verlet.solver import Verlet as Verlet
