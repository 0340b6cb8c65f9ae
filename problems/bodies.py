"""The fourteen bodies as watertight triangle meshes. Metres; z is up as they usually stand."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import PchipInterpolator
from skins import Skin, ellipses

from sgnlp.base.arrays import Array
from sgnlp.perception.synthetic.meshes import Mesh

SEGMENTS = 64  # points of a round ring
QUARTER = 7  # points of a quarter circle on a rounded edge
X, Y, Z = np.eye(3)


def circle(points: int) -> Array:
    """Points (n, 2) of the unit circle, the first on the first axis."""
    angle = 2 * np.pi * np.arange(points) / points
    return np.stack([np.cos(angle), np.sin(angle)], axis=1)


def lathe(profile: ArrayLike, points: int = SEGMENTS) -> Skin:
    """The body of revolution of a profile (k, 2) of radii and heights that begins and ends on the z axis."""
    radius, height = np.asarray(profile, np.float64).T
    ring = np.column_stack([circle(points), np.ones(points)])
    rings = ring * np.stack([radius, radius, height], axis=1)[1:-1, None]
    return Skin([0, 0, height[0]], rings, [0, 0, height[-1]])


def smooth(knots: ArrayLike, count: int) -> Array:
    """A curve (count, d) through knots (k, d) that never overshoots them."""
    points = np.asarray(knots, np.float64)
    length = np.r_[0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    return PchipInterpolator(length, points)(np.linspace(0, length[-1], count))


def rectangle(length: float, width: float, radius: float) -> Array:
    """A rectangle (n, 2) about the origin whose corners have a radius; n = 4 if that is zero."""
    quarter = np.linspace(0, np.pi / 2, QUARTER if radius > 0 else 1)
    angle = quarter + np.pi / 2 * np.arange(4)[:, None]
    centre = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * ([length / 2 - radius, width / 2 - radius])
    return (centre[:, None] + radius * np.stack([np.cos(angle), np.sin(angle)], axis=-1)).reshape(-1, 2)


def box(length: float, width: float, height: float, corner: float = 0.0, edge: float = 0.0) -> Mesh:
    """A box whose upright edges have the radius `corner`, the others a smaller one, `edge`; or both zero."""
    tilt = np.linspace(0, np.pi / 2, QUARTER) if edge > 0 else np.array([np.pi / 2])
    inset, rise = edge * (1 - np.sin(tilt)), edge * (1 - np.cos(tilt))
    levels = [*zip(inset, rise, strict=True), *zip(inset[::-1], height - rise[::-1], strict=True)]
    outlines = [(rectangle(length - 2 * i, width - 2 * i, corner - i), z) for i, z in levels]
    rings = [np.column_stack([outline, np.full(len(outline), z)]) for outline, z in outlines]
    return Skin([0, 0, 0], np.stack(rings), [0, 0, height]).mesh()


def pyramid(side: float, height: float) -> Mesh:
    """A square pyramid."""
    ring = np.column_stack([rectangle(side, side, 0.0), np.zeros(4)])
    return Skin([0, 0, 0], ring[None], [0, 0, height]).mesh()


def can(radius: float, height: float, rim: float) -> Mesh:
    """A tin: a cylinder with a rim of the given width and height at both ends, within which the lids lie."""
    lower = [(0, rim), (radius - rim, rim), (radius - rim, 0), (radius, 0), (radius, rim), (radius - rim / 3, 2 * rim)]
    return lathe([*lower, *((r, height - z) for r, z in lower[::-1])]).mesh()


def orange(diameter: float, height: float, dimple: float) -> Mesh:
    """A slightly flat ball with a dimple at its stalk."""
    angle = np.linspace(0, np.pi, SEGMENTS // 2 + 1)  # from the bottom
    radius, z = diameter / 2 * np.sin(angle), height / 2 * (1 - np.cos(angle))
    z = z - dimple * np.exp(-((np.pi - angle) ** 2) / 0.05)
    return lathe(np.stack([radius, z], axis=1)).mesh()


def pear(diameter: float, height: float) -> Mesh:
    """A pear that leans a little, and its stalk."""
    bulb = [(0, 0.03), (0.3, 0.0), (0.72, 0.06), (0.96, 0.2), (1.0, 0.33), (0.94, 0.45), (0.72, 0.6), (0.52, 0.72)]
    top = [(0.46, 0.8), (0.38, 0.87), (0.2, 0.905), (0.07, 0.9), (0.06, 0.93), (0.07, 1.0), (0.0, 1.0)]
    profile = smooth(np.array(bulb + top) * [diameter / 2, height], 40)
    mesh = lathe(profile, SEGMENTS * 3 // 4).mesh()
    lean = 0.08 * height * (mesh.vertices[:, 2] / height) ** 2
    return Mesh(mesh.vertices + np.outer(lean, X), mesh.faces)


def coffee_bottle(radius: float, neck: float, height: float) -> Mesh:
    """A round bottle: straight to 58 % of its height, a smooth shoulder, a neck, a wider cap."""
    rise = np.linspace(0, 1, 2 * QUARTER)
    shoulder = neck + (radius - neck) * (1 + np.cos(np.pi * rise)) / 2
    side = np.stack([shoulder, height * (0.58 + 0.22 * rise)], axis=1)
    foot = [(0, 0), (0.9 * radius, 0), (0.97 * radius, 0.01 * height), (radius, 0.03 * height)]
    lid = [(neck, 0.87), (1.15 * neck, 0.87), (1.15 * neck, 0.985), (1.05 * neck, 1), (0, 1)]
    return lathe([*foot, *side, *((r, height * z) for r, z in lid)]).mesh()


def mustard_bottle(width: float, depth: float, height: float) -> Mesh:
    """A squeeze bottle with an oval body and a round cap that ends in a nozzle."""
    a, b = width / 2, depth / 2
    body = [(0.9 * a, 0.88 * b, 0), (0.98 * a, 0.97 * b, 0.01), (a, b, 0.035), (0.96 * a, 0.95 * b, 0.3)]
    body += [(0.97 * a, 0.97 * b, 0.5), (0.93 * a, 0.97 * b, 0.62), (0.75 * a, 0.88 * b, 0.71)]
    body += [(0.48 * a, 0.68 * b, 0.765), (0.36 * a, 0.58 * b, 0.785)]
    cap = [(0.0185, 0.785), (0.0185, 0.87), (0.0165, 0.885), (0.0085, 0.895), (0.006, 0.94), (0.0035, 1.0)]
    levels = np.concatenate([smooth(body, 24), [(r, r, z) for r, z in cap]])
    oval = np.sign(circle(SEGMENTS)) * np.abs(circle(SEGMENTS)) ** 0.8  # a superellipse, between oval and box
    rings = [np.column_stack([oval * [x, y], np.full(SEGMENTS, height * z)]) for x, y, z in levels[: -len(cap)]]
    rings += [np.column_stack([circle(SEGMENTS) * r, np.full(SEGMENTS, height * z)]) for r, _, z in levels[-len(cap) :]]
    return Skin([0, 0, 0], np.stack(rings), [0, 0, height]).mesh()


def banana(chord: float, bend: float, radius: float) -> Mesh:
    """A tube of five blunt sides that lies along an arc of radius `bend`, a stalk at one end, a tip at the other."""
    sides, points = 5, SEGMENTS // 2
    knots = [(0, 0.0), (0.03, 0.3), (0.12, 0.75), (0.3, 0.98), (0.5, 1.0), (0.7, 0.92), (0.83, 0.6), (0.89, 0.33)]
    along, taper = smooth([*knots, (0.96, 0.27), (1.0, 0.32), (1.001, 0.0)], 40).T
    arc = np.arcsin(chord / 2 / bend) * (2 * along - 1)
    path = bend * np.stack([np.sin(arc), -np.cos(arc), np.zeros_like(arc)], axis=1)
    normal = -path / bend  # towards the centre of the arc
    angle = 2 * np.pi * np.arange(points) / points
    blunt = 1 + 0.035 * np.cos(sides * angle)
    section = blunt[:, None, None] * (np.cos(angle)[:, None, None] * normal + np.sin(angle)[:, None, None] * Z)
    rings = path + radius / blunt.max() * taper[:, None] * section  # (n, k, 3)
    return Skin(path[0], np.moveaxis(rings, 0, 1)[1:-1], path[-1]).mesh()


def mug(radius: float, height: float, wall: float, reach: float) -> Mesh:
    """A cup and its handle, a bow in the plane y = 0: a tube that joins two openings in the wall."""
    points, rows, cells = 72, 25, 4  # grid of the outer wall; an opening takes 4 x 4 of its cells
    outer = [(radius, z) for z in np.linspace(0, height, rows)]
    cup = lathe([(0, 0), *outer, (radius - wall, height), (radius - wall, wall), (0, wall)], points)
    columns = (-cells // 2, cells // 2)
    low, high = (cup.opening((row, row + cells), columns) for row in (rows // 5, rows - 1 - rows // 5 - cells))
    thick = np.pi * radius / points * cells  # the handle's radius around the cup's axis, and along it
    bow = np.linspace(-np.pi / 2, np.pi / 2, points // 3)[1:-1, None]
    drop = height / 2 - cup.vertices[low][:, :, 2].mean()
    centres = [radius, 0, height / 2] + reach * np.cos(bow) * X + drop * np.sin(bow) * Z
    turned = [ellipses(low, [[0, 0, 0]], [[thick, thick]], *frame(a))[0] for a in bow[:, 0]]
    cup.handle(low, centres[:, None] + np.stack(turned), high[::-1])
    return cup.mesh()


def frame(angle: float) -> tuple[Array, Array]:
    """Along and outwards of a tube that leaves along x at -90 degrees and comes back at 90."""
    outwards = -np.sin(angle) * X + np.cos(angle) * Z
    return np.cross(outwards, Y), outwards


def lego(studs: tuple[int, int], pitch: float, height: float, radius: float, rise: float) -> Mesh:
    """A toy brick with studs on its top."""
    cell = np.array([-0.5, -0.32, -0.16, 0, 0.16, 0.32]) * pitch  # lines of the top's grid about each stud
    lines = [np.r_[(np.arange(n)[:, None] * pitch + cell).ravel(), (n - 0.5) * pitch] for n in studs]
    x, y = (line - (line[0] + line[-1]) / 2 for line in lines)
    section = np.array([(y[-1], 0), *((v, height) for v in y[::-1]), (y[0], 0)])  # (n, 2) turns about x
    rings = np.stack([np.column_stack([np.full(len(section), u), section]) for u in x])
    brick = Skin([x[0], 0, height / 2], rings, [x[-1], 0, height / 2])
    levels = [(radius, 0), (radius, 0.9 * rise), (0.9 * radius, rise)]
    for i in range(studs[0]):
        for j in range(studs[1]):
            block = brick.opening((6 * i + 1, 6 * i + 5), (6 * j + 2, 6 * j + 6))
            foot = brick.vertices[block[2, 2]]
            centres = [foot + z * Z for _, z in levels]
            brick.limb(block, ellipses(block, centres, [(r, r) for r, _ in levels], X, Z), foot + rise * Z)
    return brick.mesh()


def car(length: float, width: float, height: float, wheel: float) -> Mesh:
    """A toy car: bonnet, cabin and boot on four wheels of the given radius."""
    tread, gap, floor, hub = 0.009, 0.0015, 0.45 * wheel, 0.35 * wheel
    half, shoulder = width / 2 - tread - gap, 0.55 * height
    wheels = np.array([-0.29, 0.3]) * length
    cells = np.linspace(-hub, hub, 7)
    roof = [(-0.5, 0.5), (-0.47, 0.6), (-0.36, 0.66), (-0.24, 0.95), (-0.18, 1.0), (0.03, 1.0), (0.09, 0.95)]
    roof += [(0.22, 0.68), (0.42, 0.62), (0.47, 0.58), (0.5, 0.5)]
    x = np.unique(np.r_[np.array(roof)[:, 0] * length, (wheels[:, None] + cells).ravel()])
    top = np.interp(x / length, *np.transpose(roof)) * height
    end = np.interp(np.abs(x) / length, [0.45, 0.485, 0.5], [1.0, 0.96, 0.88])  # the body narrows at its ends
    side = [floor, *(wheel + cells), shoulder]
    rings = []
    for u, roof_z, narrow in zip(x, top, end, strict=True):
        belt = min(shoulder, roof_z - 0.02 * height)
        w, lean = narrow * half, max(0.08, 0.4 * (roof_z - belt) / height)
        left = [(w, min(z, belt)) if z < shoulder else (w, belt) for z in side]
        left += [(w * (1 - 0.5 * lean), (belt + roof_z) / 2), (w * (1 - lean), roof_z)]
        rings.append([(u, y, z) for y, z in [*left, *((-y, z) for y, z in left[::-1])]])
    ends = [[u, 0, (floor + 0.5 * height) / 2] for u in x[[0, -1]]]
    body = Skin(ends[0], np.array(rings), ends[1])
    count = len(rings[0])
    for centre in wheels:
        row = int(np.argmin(np.abs(x - (centre - hub))))
        for sign, column in ((1, 1), (-1, count - 8)):
            block = body.opening((row, row + 6), (column, column + 6))
            levels = [(0.8 * hub, 0), (0.8 * hub, gap), (0.92 * wheel, gap), (wheel, gap + 0.001)]
            levels += [(wheel, gap + tread - 0.001), (0.92 * wheel, gap + tread), (0.6 * wheel, gap + tread - 0.002)]
            centres = [[centre, sign * (half + out), wheel] for _, out in levels]
            radii = [(r, r) for r, _ in levels]
            body.limb(block, ellipses(block, centres, radii, X, sign * Y), centres[-1])
    return body.mesh()


def plane(length: float, span: float, height: float) -> Mesh:
    """A toy aeroplane: a fuselage with a nose, two swept wings, a tailplane and a fin."""
    points, rows = 24, 47
    radius = 0.3 * height
    knots = [(0, 0.22), (0.02, 0.32), (0.15, 0.45), (0.4, 0.8), (0.6, 1.0), (0.85, 0.95), (0.95, 0.7), (0.99, 0.35)]
    share, thick = smooth([*knots, (1.0, 0.1)], 200).T
    along = np.linspace(0, 1, rows)  # from the tail to the nose
    girth = radius * np.interp(along, share, thick)
    lift = radius * (1.0 + 0.35 * (1 - along) ** 2)  # the tail rises
    x = length * along
    ring = circle(points)[None] * girth[:, None, None]
    rings = np.concatenate([np.broadcast_to(x[:, None, None], (rows, points, 1)), ring], axis=2)
    rings[:, :, 2] += lift[:, None]
    body = Skin([x[0], 0, lift[0]], rings, [x[-1], 0, lift[-1]])

    def wing(rows: tuple[int, int], column: int, out: Array, reach: float, sweep: float, tip: float) -> None:
        """A fin out of the skin: its chord shrinks to a share `tip`, its middle moves back by `sweep`."""
        block = body.opening(rows, (column - 1, column + 1))
        root = body.vertices[block].mean(axis=(0, 1))
        chord, depth = 0.5 * (x[rows[1]] - x[rows[0]]), 0.045 * height
        steps = np.array([0.0015 / reach, 0.25, 0.5, 0.75, 0.95, 1.0])
        shrink = 1 - (1 - tip) * steps
        shrink[-1] *= 0.85
        centres = root + np.outer(steps * reach, out) - np.outer(steps * sweep, X)
        radii = np.stack([chord * shrink, depth * (0.5 + 0.5 * shrink)], axis=1)
        body.limb(block, ellipses(block, centres, radii, X, out), centres[-1] + 0.0005 * out)

    half = span / 2 - radius
    for column, out in ((0, Y), (points // 2, -Y)):
        wing((21, 34), column, out, half, 0.12 * length, 0.55)
        wing((1, 7), column, out, 0.38 * half, 0.04 * length, 0.6)
    wing((1, 8), points // 4, Z, height - lift[4] - girth[4], 0.06 * length, 0.5)
    return body.mesh()
