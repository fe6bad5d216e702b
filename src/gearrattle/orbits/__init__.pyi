from .branch import Branch as Branch
from .find import periodic as periodic
from .follow import continuation as continuation
from .motion_map import MotionMap as MotionMap
from .motions import PeriodicMotions as PeriodicMotions
from .orbit import Orbit as Orbit
from .run_ups import RunUpJumps as RunUpJumps
