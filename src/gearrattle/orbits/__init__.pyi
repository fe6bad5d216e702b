from .branch import Branch as Branch
from .find import periodic as periodic
from .follow import continuation as continuation
from .motion_map import MotionMap as MotionMap
from .orbit import Orbit as Orbit
from .orbit import PeriodicMotions as PeriodicMotions
from .run_ups import RunUpJumps as RunUpJumps
