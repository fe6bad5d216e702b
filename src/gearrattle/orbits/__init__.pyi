from .branch import Branch as Branch
from .branch_following import continuation as continuation
from .motion_map import MotionMap as MotionMap
from .orbit import Orbit as Orbit
from .orbit import PeriodicMotions as PeriodicMotions
from .periodic_search import periodic as periodic
from .run_ups import RunUpJumps as RunUpJumps
