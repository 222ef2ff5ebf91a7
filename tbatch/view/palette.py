"""Colours with a fixed meaning in every picture, readable on dark ground and told apart by colour-blind eyes.

The wheel colours are the light ones of Okabe and Ito's set (Color Universal Design, 2008), lifted a little for dark
ground; its vermilion is kept for warnings and used for nothing else.
"""

Colour = tuple[int, int, int]

WHEELS: tuple[Colour, ...] = (
    (86, 180, 233),  # sky blue
    (240, 228, 66),  # yellow
    (46, 190, 140),  # bluish green
    (214, 139, 185),  # reddish purple
    (235, 235, 235),  # near white
    (150, 140, 245),  # lavender
    (190, 160, 110),  # sand
    (120, 205, 215),  # pale cyan
)
BODIES: tuple[Colour, ...] = (
    (232, 232, 232),  # carbody
    (240, 170, 60),  # first bogie
    (110, 150, 245),  # second bogie
)
WARNING: Colour = (255, 82, 38)  # vermilion: a separated wheel, and only that
CONTACT: Colour = (52, 78, 92)  # quiet: nothing to see here

CARBODY: Colour = (74, 92, 120)
WINDOW: Colour = (150, 185, 215)
DISC: Colour = (96, 102, 112)
BOGIE: Colour = (128, 138, 152)
SPRING: Colour = (176, 184, 196)
RAIL: Colour = (208, 214, 222)
RAIL_FOOT: Colour = (126, 136, 148)
SLAB: Colour = (104, 104, 108)
BASE: Colour = (74, 72, 72)
SLAB_LINE: Colour = (222, 178, 110)
BASE_LINE: Colour = (120, 170, 220)
GRID: Colour = (58, 62, 70)
MARK: Colour = (150, 150, 155)
GROUND: Colour = (20, 22, 26)


def wheel_colour(wheel: int) -> Colour:
    """Colour of a wheel, counted from 0 at the front; after eight they repeat."""
    return WHEELS[wheel % len(WHEELS)]


def run_colour(run: int) -> Colour:
    """Colour of one of several runs, the first one near white; after eight they repeat."""
    return WHEELS[(4, 1, 0, 2, 3, 5, 6, 7)[run % len(WHEELS)]]


def body_colours(count: int) -> list[Colour]:
    """Colours of the sprung bodies, carbody first."""
    return [BODIES[k % len(BODIES)] for k in range(count)]
