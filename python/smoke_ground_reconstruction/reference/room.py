"""What one scan shows of its room, in the frame that stands its walls upright."""

import math

import numpy as np

from . import wall_feet
from .azimuth_bins import around_columns
from .cells import cell_keys, cell_numbers
from .drop_edges import DropTolerances
from .drop_offs import find_drop_offs
from .floor_relief import FLAT, FLATNESS, HIGHEST, LOWEST, find_relief
from .hidden_drops import certain_floor
from .ordered import ordered_sum, times
from .posts import ceiling_height, find_posts, spread_of_walls, widening_for
from .sample import FEWEST, sample
from .scan import rotated
from .wall_lines import Returns, View, find_lines, line_support
from .wall_profile import column_profile
from .wall_ramps import find_wall_ramp, places_of_feet

BEYOND = 0.15  # floor measured this far behind the boundary lies behind an opening [m]
_ON_FLOOR, _ON_FLOOR_MOST = 0.03, 0.06  # a return so near to the plane may be floor [m]
_UNEVENNESS = 3.0  # or within so many sigma of the floor's own height
_LEVEL_SHARE = 0.4  # floor behind an opening must go on as level as this share of it
_LEVEL_BAND = 5.0  # and tells so by heights up to so many times of it
_DROP = 0.01  # and what lies so much lower than floor can, tells of a drop [m]
_RELIEF_LOWEST, _RELIEF_HIGHEST = 0.15, 0.8  # heights that relief looks at [m]
_FEET_SHARE = 0.2  # of a plane's returns at walls: more than most floors have
_UNDER_PLANE = 0.005  # walls end at the floor: their returns so far below a plane [m]
_UNDER_SHARE = 0.05  # are few of those near it where it is one
_POSTS_BESIDE = 2  # columns
_NEAREST_WALL, _FARTHEST_WALL = 0.2, 65.0  # planar range [m]
_BELOW_CEILING = 0.05
_WALL_FOOT = 0.05  # returns so near to a wall's line may be its foot [m]
_SOFT_RANGE = 1.5  # smoke's own returns come from nearer [m]
_FLOOR_RANGE = 2.5  # [m]
_PLUMB = 0.99998629  # floors tilted by less than 0.3 deg (its cosine) are taken as level
_WALL_LIGHTS = 2000  # returns of walls, at least, that tell the smoke
_SLOPE_SLOTS, _SLOTS_PER_SLOPE = 2048, 128.0
_LOOKED_AT = 4000  # returns, at least, that tell the highest beam
# Returns are thinned out to the cube root of this times the floor's returns: where a cell of 0.2 m
# would have ten of these [m^3].
_THINNED = 1.2e-3
_STRENGTHS = 1000  # returns of floor, at least, if there are as many
_STEEPER = 1000  # one return in so many may lie above the highest beam
_RISES = 0.02  # floor so far over its plane rises [m]
_HIDDEN_SLOPE = 1.0 / 12.0  # half the steepest ramp's
_OPENING_CELL = 0.2
_OPENING_POINTS = 3
_FLOOR_POINTS = 2


class Room:
    """The returns of one scan in an upright frame, and what stands in it.

    Parameters
    ----------
    xyz : (N, 3) float32
        Returns in the level frame [m].
    intensity : (N,) float64
    floor : FloorModel
    rotation : (3, 3) float64
        From the level to the upright frame.
    bins : AzimuthBins
        The columns.
    params : RoomBoundaryParams

    Attributes
    ----------
    tolerance : float
        A return so near to the plane may be floor [m],
    lift : float
        or so near times its range [m2].
    spread : float
        How far walls' returns stray, as by spread_of_walls() [m].
    widening : float
        Of the places of walls, as by widening_for().
    """

    def __init__(self, xyz, intensity, floor, rotation, bins, params):
        self.params = params
        self.tolerance = params.floor_tolerance or floor_tolerance(floor)
        self.lift = 0.0 if params.floor_tolerance > 0.0 else floor_lift(floor)
        self.rotation = rotation
        self.xyz = rotated(rotation, xyz).astype(np.float64)
        self.intensity = intensity
        self.plane = rotated_plane(floor.plane, rotation)
        self.columns = bins.count()
        # In single precision, as the coordinates are.
        x, y, z = self.xyz.astype(np.float32).T
        a, b, c = self.plane.astype(np.float32)
        self.height = (z - ((a * x + b * y) + c)).astype(np.float64)
        self.planar = np.sqrt(x * x + y * y).astype(np.float64)
        self.column = bins.index(*self.xyz[:, :2].T)
        self.ceiling = ceiling_height(self.height, self.planar, self.column)
        self.is_low = self._on_floor() & (self.planar < params.max_range)
        self.is_soft = self._soft()
        self.can_be_wall = (self.height > params.min_wall_height) & ~self.is_soft
        self.can_be_wall &= self.height < self.ceiling - _BELOW_CEILING
        self.can_be_wall &= (self.planar > _NEAREST_WALL) & (self.planar < _FARTHEST_WALL)
        arrays = (self.column, self.planar, self.height, self.xyz[:, :2])
        self.returns = Returns(*(array[self.can_be_wall] for array in arrays))
        self.spread = spread_of_walls(self.returns.column, self.returns.planar)
        self.widening = widening_for(self.spread)
        self.posts = find_posts(*vars(self.returns).values(), self.widening)
        self.relief = FLAT

    def _on_floor(self):
        """Which returns lie on the plane, as far as their noise lets them?"""
        height = self.height.astype(np.float32)
        lifted = height * height * self._square()
        return (np.abs(self.height) < self.tolerance) | (lifted < np.float32(self.lift * self.lift))

    def _square(self):
        """Of ranges, in single precision."""
        planar, z = self.planar.astype(np.float32), self.xyz[:, 2].astype(np.float32)
        return planar * planar + z * z

    def _soft(self):
        """Returns of smoke near the sensor: weaker, range apart, than walls are beside the floor.

        Intensity enters as a ratio to the floor's, so the sensor's scale does not matter.
        """
        low = np.flatnonzero(self.is_low)
        near = (self.planar < _FLOOR_RANGE) & (np.abs(self.height) < self.tolerance)
        for fewest in (FEWEST, len(low)):
            floor = low[sample(len(low), fewest)]
            floor = floor[near[floor]]
            if len(floor) >= _STRENGTHS:
                break
        if len(floor) == 0:
            return np.zeros(len(self.xyz), bool)
        x, y, z = self.xyz[floor].T
        strength = self.intensity[floor] * ((x * x + y * y) + z * z)
        # The mean: where smoke leaves whole numbers of 0 and 1, a median would be 0.
        gate = self.params.smoke_gate * (ordered_sum(strength) / len(floor))
        square = self._square()
        near = square < np.float32(_SOFT_RANGE * _SOFT_RANGE)
        soft = near & (self.intensity.astype(np.float32) * square < np.float32(gate))
        return soft & (self.height > self.params.min_wall_height)

    def stands_on_walls(self):
        """Does the plane pass through the feet of walls, not through a floor?

        A fifth of its returns stand where a post of their column does, as may be on a floor that
        few rings meet; but some of these lie below the plane, where no wall goes on below a floor.
        """
        low = np.flatnonzero(self.is_low)
        low = low[sample(len(low))]
        at_posts = low[self.posts.are_at(self.columns, self.column[low], self.planar[low])]
        if len(at_posts) <= _FEET_SHARE * len(low):
            return False
        under = np.count_nonzero(self.height[at_posts] < -_UNDER_PLANE)
        return under > _UNDER_SHARE * len(at_posts)

    def is_at_post(self):
        """(N,) bool: does a post stand there, in the column or in the two to either side?"""
        return self.posts.are_at(self.columns, self.column, self.planar, _POSTS_BESIDE)

    def find_walls(self, directions):
        """Relief, lines, the profile of the boundary and the drop-offs."""
        self._find_relief()
        self.view = View(
            self.ceiling, -self.plane[2], self._steepest(), self.params.furniture_height
        )
        self.lines = find_lines(self.posts, self.widening)
        support = line_support(self.returns, self.lines, directions, self.view, self.widening)
        self._see_floor(support)
        level_floor = self.farthest(self.is_low & ~self.at_wall & self.goes_on_level())
        ceiling = np.zeros(self.columns)
        if math.isfinite(self.ceiling):
            ceiling = self.farthest(self._is_at_ceiling())
        beyond = np.maximum(self.seen_floor, ceiling)
        self.profile = column_profile(
            self.posts,
            support,
            self.view,
            beyond,
            level_floor,
            directions,
            self.params.max_bridge_ratio,
            self.spread,
        )
        if self._find_ramp():
            self._see_floor(support)
        self.drops = self._drop_offs(directions)
        if not np.isfinite(self.drops.begin).any():
            # A ceiling seen overhead has a floor beneath, unless floors are known to end here.
            self.seen_floor = np.maximum(self.seen_floor, ceiling - BEYOND)
        low_wall = np.bincount(self.column[self._low_on_walls()], minlength=self.columns)
        rises = self.farthest(self.is_low & self._rises(), beside=0) > 0.0
        stands = self._stands()
        self.standing_low = self.farthest(stands & (self.height < wall_feet.UP_TO), beside=0)
        standing = self.farthest(stands)
        self.certain_floor = certain_floor(
            self.own_floor, self.profile.distance, self.drops, low_wall, standing, rises
        )

    def _see_floor(self, support):
        """How far floor is measured, walls' feet left out."""
        self.at_wall = self._at_a_wall(support)
        # A riser has floor at its foot.
        riser = ~self.is_soft & self.relief.is_riser(self.xyz[:, :2], self.height)
        floor = (self.is_low & ~self.at_wall) | riser
        self.seen_floor, self.own_floor = self.farthest(floor), self.farthest(floor, beside=0)

    def _find_ramp(self):
        """Looks for a ramp along the walls where smoke may hide one; True if one is found.

        A ramp, found or measured, is fitted to all that lies on it.
        """
        was_flat = self.relief.is_flat()
        if was_flat and np.all(self.profile.distance > 0.0):
            return False
        feet = self._feet_of_walls()
        normals = np.column_stack([self.lines.nx, self.lines.ny])
        if was_flat:
            ramp = find_wall_ramp(*feet, normals, self.params.max_slope)
            if ramp is None:
                return False
            self.relief = self.relief.with_ramp(ramp, *self._thinned())
            self._take_carried()
        off_walls = ~(np.abs(self.past_wall()) < _WALL_FOOT * self.widening) & ~self.at_wall
        floor = self.is_low & off_walls & ~self.is_soft
        self.relief = self.relief.with_ramp_fitted(
            np.column_stack([self.xyz[floor, :2], self.height[floor]]),
            places_of_feet(*feet, normals, self.lines.rho),
            self._wall_normals(),
            self.params.max_slope,
        )
        return was_flat and not self.relief.is_flat()

    def _feet_of_walls(self):
        """Line, place along it and height of low returns on the boundary's walls."""
        low = ~self.is_soft & (self.height > LOWEST) & (self.height < HIGHEST)
        at = np.flatnonzero(low & (np.abs(self.past_wall()) < _WALL_FOOT * self.widening))
        line = self.profile.line[self.column[at]]
        along = self.lines.nx[line] * self.xyz[at, 1] - self.lines.ny[line] * self.xyz[at, 0]
        return line, along, self.height[at]

    def _rises(self):
        """Where the relief lies clear of the plane."""
        return self.relief.at(self.xyz[:, :2]) > _RISES

    def _find_relief(self):
        self.relief = find_relief(*self._thinned(), self.params)
        self._take_carried()

    def _thinned(self):
        """Places, heights and planar ranges of what tells the relief.

        All about the floor's height but smoke, the nearer ones thinned: of those at a planar range
        r a share of r^3 / cube [m^3], for a floor's returns grow denser by that.
        """
        band = _LEVEL_BAND * self.tolerance
        near = self.height > -max(_RELIEF_LOWEST, band)
        near &= self.height < max(_RELIEF_HIGHEST, band)
        hard = np.flatnonzero(near & ~self.is_soft)
        cube = _THINNED * np.count_nonzero(self.is_low)
        planar = self.planar[hard].astype(np.float32)
        share = planar * planar * planar * np.float32(2.0**24 / cube if cube > 0.0 else math.inf)
        # The parts of multiples of the golden ratio are evenly spread in any row of them.
        part = ((hard.astype(np.uint64) * 0x9E3779B1) & 0xFFFFFFFF) >> 8
        some = hard[part.astype(np.float32) < share]
        return self.xyz[some, :2], self.height[some], self.planar[some]

    def _take_carried(self):
        """Floor off the plane is as low as that on it."""
        on = np.flatnonzero(~self.is_soft & (self.planar < self.params.max_range))
        on = on[self.relief.carries(self.xyz[on, :2], self.height[on])]
        self.is_low[on] = True

    def _is_at_ceiling(self):
        height, ceiling = self.height, self.ceiling
        found = (height > ceiling - _BELOW_CEILING) & (height < ceiling + _BELOW_CEILING)
        return found & (height > self.params.min_wall_height)

    def _steepest(self):
        """Tangent of the elevation up to which all but one return in a thousand lie, in steps."""
        some = sample(len(self.xyz), _LOOKED_AT)
        some = some[self.planar[some] > _NEAREST_WALL]
        slope = np.floor(self.xyz[some, 2] / self.planar[some] * _SLOTS_PER_SLOPE)
        slot = np.clip(slope, -_SLOPE_SLOTS, _SLOPE_SLOTS - 1).astype(np.int64) + _SLOPE_SLOTS
        above = np.cumsum(np.bincount(slot, minlength=2 * _SLOPE_SLOTS)[::-1])
        if above[-1] == 0:
            return 0.0
        highest = 2 * _SLOPE_SLOTS - int(np.argmax(above > above[-1] // _STEEPER))
        return (highest - _SLOPE_SLOTS) / _SLOTS_PER_SLOPE

    def _at_a_wall(self, support):
        """Low returns on the line of a wall that is seen in a column near by."""
        near = np.zeros(len(self.xyz), bool)
        if len(self.lines.rho) > 0:
            low = np.flatnonzero(self.is_low)
            on = self.lines.distances(self.xyz[low, :2]) < _WALL_FOOT * self.widening
            near[low] = (on & support.seen_near()[:, self.column[low]]).any(axis=0)
        return near

    def farthest(self, which, beside=2, rank=3):
        """How far some returns are seen in each column or some beside it [m], else 0.

        The third farthest of a column tells. Not all rings fire in each column.
        """
        column, planar = self.column[which], self.planar[which]
        order = np.lexsort((-planar, column))
        begin = np.searchsorted(column[order], np.arange(self.columns))
        enough = np.bincount(column, minlength=self.columns) >= rank
        found = np.zeros(self.columns)
        found[enough] = planar[order][begin[enough] + rank - 1]
        return around_columns(found, beside, np.max)

    def _drop_offs(self, directions):
        distance = self.profile.distance[self.column]
        inside = (self.planar < distance + 2 * BEYOND) | (distance == 0.0)
        floor = self.is_low & ~self.at_wall
        floor &= (self.planar < distance - _WALL_FOOT * self.widening) | (distance == 0.0)
        return find_drop_offs(
            self.column[inside],
            self.planar[inside],
            self.height[inside],
            floor[inside],
            -self.plane[2],
            directions,
            self._wall_normals(),
            self._wall_feet(),
            self._drop_tolerances(),
        )

    def _drop_tolerances(self):
        if self.params.drop_depth > 0.0:
            return DropTolerances(self.params.drop_depth, 0.0, self.widening)
        return DropTolerances(self.tolerance + _DROP, self.lift, self.widening)

    def flatness(self):
        """How far the floor may stray from its plane per metre away from where it is measured [m].

        Smoke that may hide a drop may as well hide a ramp, which rises by two such sigmas.
        """
        return _HIDDEN_SLOPE if np.isfinite(self.certain_floor).any() else FLATNESS

    def _low_on_walls(self):
        near = np.abs(self.planar - self.profile.distance[self.column]) < wall_feet.OFF_WALL
        return near & self._low_down()

    def _low_down(self):
        low = (self.height > wall_feet.LOWEST) & (self.height < wall_feet.HIGHEST)
        return low & ~self.is_soft

    def _stands(self):
        """Which returns, low down, are of something that stands in the room."""
        distance = self.profile.distance[self.column]
        inside = (distance == 0.0) | (self.planar - distance < wall_feet.OFF_WALL)
        return self._low_down() & inside

    def _wall_feet(self):
        distance = self.profile.distance[self.column]
        foot = self._low_on_walls() & (self.height < wall_feet.STEEPEST * distance)
        return wall_feet.WallFeet(self.column[foot], self.height[foot], self.profile.distance)

    def _wall_normals(self):
        """Of the walls that bound the room, (W, 2)."""
        walls = np.unique(self.profile.line[self.profile.line >= 0])
        return np.column_stack([self.lines.nx[walls], self.lines.ny[walls]])

    def goes_on_level(self):
        """Is a return's cell as level as the floor?

        The median of its low returns decides. Where they are few, that of the cells around it does,
        too, and no post may stand there: one ring on a far wall is as level.
        """
        return self._have_cells_near(_LEVEL_SHARE * self.tolerance, _OPENING_POINTS)

    def _have_cells_near(self, half, points):
        """Whose (N,) returns' cells have medians so near to the plane [m]? Cells of fewer returns
        than `points` together with those around them, which have three."""
        low = self._level_band()
        cell = cell_keys(self.xyz, _OPENING_CELL)
        cells, at = np.unique(cell[low], return_inverse=True)
        height = self.height[low]
        below = np.ones(len(low), bool), height < half, height <= -half
        own = np.array([np.bincount(at[which], minlength=len(cells)) for which in below])
        around = np.zeros_like(own)
        for step in np.ndindex(3, 3):
            beside = cells + cell_numbers(np.array([step]) - 1)
            place = np.minimum(np.searchsorted(cells, beside), len(cells) - 1)
            around += np.where(cells[place] == beside, own[:, place], 0)
        is_level, many = _is_median_between(*own), own[0] >= points
        around_too = (around[0] >= _OPENING_POINTS) & _is_median_between(*around)
        found = np.isin(cell, cells[is_level & many])
        few = np.flatnonzero(np.isin(cell, cells[is_level & ~many & around_too]))
        at = self.column[few], self.planar[few]
        found[few] = ~self.posts.are_at(self.columns, *at, _POSTS_BESIDE)
        return found

    def _level_band(self):
        low = np.abs(self.height) < _LEVEL_BAND * self.tolerance
        return np.flatnonzero(low & (self.planar < self.params.max_range))

    def is_floor_cell(self):
        """Is a return's cell one of floor? That of a lone one is if those around it are."""
        return self._have_cells_near(self.tolerance, _FLOOR_POINTS)

    def past_wall(self):
        """How far (N,) returns lie beyond the line of their column's boundary [m].

        Negative infinity where that is no line. A column's own distance is that of its middle;
        along an oblique wall its edges differ by more than the walls are known to.
        """
        line = self.profile.line[self.column]
        known = line >= 0
        past = np.full(len(line), -np.inf)
        nx, ny, rho = (values[line[known]] for values in vars(self.lines).values())
        past[known] = (nx * self.xyz[known, 0] + ny * self.xyz[known, 1]) - rho
        return past

    def is_wall(self):
        """Returns on the line of their column's boundary."""
        return self.can_be_wall & (np.abs(self.past_wall()) < _WALL_FOOT * self.widening)

    def rotation_from_sensor(self, mounting):
        """From the sensor's to the upright frame, (3, 3) float64."""
        return np.column_stack([times(self.rotation, axis) for axis in mounting.rotation.T])

    def visibility(self, estimator):
        """The smoke's extinction from the boundary's walls, by a VisibilityEstimator."""
        wall = np.flatnonzero(self.is_wall())
        millimetres = np.floor(self.planar[wall] * 1000.0)
        wall = wall[np.lexsort((millimetres, self.column[wall]))]
        wall = wall[:: max(1, len(wall) // _WALL_LIGHTS)]
        line, (x, y, z) = self.profile.line[self.column[wall]], self.xyz[wall].T
        ranges = np.sqrt((x * x + y * y) + z * z)
        cosine = np.abs(self.lines.nx[line] * x + self.lines.ny[line] * y) / ranges
        return estimator.estimate(line, ranges, self.intensity[wall], cosine)


def _is_median_between(count, below_top, below_bottom):
    """The median is the value at `count // 2` in ascending order."""
    return (below_top > count // 2) & (below_bottom <= count // 2)


def floor_tolerance(floor):
    """How near to the plane floor lies [m], from the unevenness that the scan tells."""
    return min(max(_ON_FLOOR, _UNEVENNESS * floor.uneven), _ON_FLOOR_MOST)


def floor_lift(floor):
    """How near to the plane floor lies, times the range [m2], where a range's noise lifts it: noise
    times the sine of the grazing angle, the sensor's height over the range."""
    return _UNEVENNESS * floor.noise * -float(floor.plane[2])


def upright_candidates(plane):
    """Rotations (3, 3) that may stand the walls upright: none, and the one that levels the floor.

    A tilted floor in a plumb building has plumb walls; a tilted sensor sees both tilted alike.
    """
    a, b = float(plane[0]), float(plane[1])
    length = math.sqrt((a * a + b * b) + 1.0)
    x, y, z = -a / length, -b / length, 1.0 / length
    if z > _PLUMB:
        return [np.eye(3)]
    rest = 1.0 / (1.0 + z)
    across = -(x * y) * rest
    turned = [[1.0 - x * x * rest, across, -x], [across, 1.0 - y * y * rest, -y], [x, y, z]]
    return [np.eye(3), np.array(turned)]


def rotated_plane(plane, rotation):
    """z = a x + b y + c in a frame turned by a rotation."""
    normal = times(rotation, (-plane[0], -plane[1], 1.0))
    return np.array([-normal[0] / normal[2], -normal[1] / normal[2], plane[2] / normal[2]])
