from .bodies import COLOURS as COLOURS
from .bodies import draw_game as draw_game
from .episodes import draw_paths as draw_paths
from .moments import draw_moment as draw_moment
from .profiles import draw_profile as draw_profile
