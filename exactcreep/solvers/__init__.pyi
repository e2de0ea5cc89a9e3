from .exact.settling import SettlingSearch as SettlingSearch
from .exact.solver import Exact as Exact
from .field.certified import Certified as Certified
from .field.known_itinerary import KnownItinerary as KnownItinerary
from .sliding import Sliding as Sliding, relaxed_cycle as relaxed_cycle
from .verlet.solver import Verlet as Verlet
