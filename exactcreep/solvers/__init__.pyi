from .exact.settling import SettlingSearch as SettlingSearch
from .exact.solver import Exact as Exact
from .field.certified import Certified as Certified
from .sliding import Sliding as Sliding
from .verlet.solver import Verlet as Verlet
