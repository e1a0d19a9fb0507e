"""Where light, block and receiver stand, in the bench's frame: mm, light along +z, the receiver at z = distance."""

import json
import math
from dataclasses import asdict, dataclass, replace

import numpy as np

#: A lamp this far away sends parallel light, mm. A sun would bring no light through glass by Cycles' shadow caustics.
FAR_MM = 1e6
#: Between frame and entry face, mm.
GAP_MM = 0.05


@dataclass(frozen=True)
class Bench:
    """Numbers of a bench, mm and radians."""

    index: float
    distance: float
    #: Least and greatest corner of the block.
    lower: tuple
    upper: tuple
    #: Least and greatest corner of the picture on the receiver.
    window: tuple
    #: Unit vector along which parallel light travels.
    along: tuple
    #: Where a point source stands; `None` of parallel light.
    source: tuple
    #: Angle that the light has, seen from the block, in radians.
    light_angle: float
    #: Irradiance where the picture is brightest, as a part of the mean.
    brightest: float

    @classmethod
    def of(cls, told, solid, source_size, brightest):
        """From a side file's numbers.

        Raises:
            ValueError: A light that is not round.
        """
        width, height, (x, y) = told["window-width-mm"], told["window-height-mm"], told["window-centre-mm"]
        source = told.get("source-mm")
        bench = cls(
            index=told["ior"],
            distance=told["distance-mm"],
            lower=tuple(map(float, solid.lower)),
            upper=tuple(map(float, solid.upper)),
            window=((x - width / 2, y - height / 2), (x + width / 2, y + height / 2)),
            along=tuple(told["light-direction"]),
            source=source and tuple(source),
            light_angle=0.0,
            brightest=float(brightest),
        )
        away = None if source is None else float(np.linalg.norm(bench.lamp - bench.entry))
        return replace(bench, light_angle=angle_of(source_size, away))

    @property
    def entry(self):
        """Middle of the entry face."""
        (x0, y0, z), (x1, y1, _) = self.lower, self.upper
        return np.array([(x0 + x1) / 2, (y0 + y1) / 2, z])

    @property
    def lamp(self):
        """Where the lamp stands."""
        return self.entry - FAR_MM * np.array(self.along) if self.source is None else np.array(self.source)

    @property
    def lamp_radius(self):
        return math.tan(self.light_angle / 2) * float(np.linalg.norm(self.lamp - self.entry))

    @property
    def reach(self):
        """Half the side of a square about the axis that is three times as wide as block and window."""
        return 3 * max(abs(c) for corner in (self.lower[:2], self.upper[:2], *self.window) for c in corner)

    @property
    def hole(self):
        """The part of the entry face by which light comes: not along a wall that oblique light would meet from inside."""
        lower, upper = np.array(self.lower[:2]), np.array(self.upper[:2])
        height = self.upper[2] - self.lower[2]
        middle = (lower + upper) / 2 if self.source is None else np.clip(self.lamp[:2], lower, upper)

        def aside(x, y):
            ray = np.array(self.along) if self.source is None else np.array([x, y, self.lower[2]]) - self.lamp
            inside = ray[:2] / np.linalg.norm(ray) / self.index
            return inside * height / math.sqrt(1 - inside @ inside)

        start = np.array([-aside(lower[0], middle[1])[0], -aside(middle[0], lower[1])[1]])
        end = np.array([aside(upper[0], middle[1])[0], aside(middle[0], upper[1])[1]])
        return lower + np.maximum(start, 0), upper - np.maximum(end, 0)

    def irradiance(self, brightest):
        """Irradiance across the light at the entry face, with which the picture is this bright where it is brightest."""
        (x0, y0), (x1, y1) = self.window
        towards = self.entry - self.lamp
        lit = np.prod(self.hole[1] - self.hole[0]) * towards[2] / np.linalg.norm(towards)
        return brightest / self.brightest * (x1 - x0) * (y1 - y0) / lit

    def to_text(self):
        return json.dumps(asdict(self))

    @classmethod
    def from_text(cls, text):
        return cls(**json.loads(text))


def angle_of(size, source_distance):
    """Angle under which a round light of a size as glasswarp takes it is seen, radians.

    Raises:
        ValueError: A light that is not round, or whose size is a length where no distance is known.
    """
    text = size.strip().lower()
    if text in ("", "none"):
        return 0.0
    if text == "sun":
        return math.radians(0.53)
    for unit, scale in (("deg", None), ("mm", 1.0), ("cm", 10.0), ("m", 1000.0)):
        if text.endswith(unit):
            try:
                number = float(text[: -len(unit)])
            except ValueError:
                break
            if scale is None:
                return math.radians(number)
            if source_distance is None:
                break
            return 2 * math.atan(number * scale / 2 / source_distance)
    raise ValueError(
        f"Cycles is shown round lights only: the size of the light, '{size}', can be none, sun, 0.5deg, or 5mm of a lamp"
    )
