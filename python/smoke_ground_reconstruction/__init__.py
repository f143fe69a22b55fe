"""The full floor of a smoke-filled room from one LiDAR scan.

``Pipeline(Params(...)).process(xyz, intensity, ring) -> Result``: see :mod:`.pipeline`. The method
in NumPy, to be read beside the thesis: :mod:`.reference`.
"""

from .params import Params
from .pipeline import Pipeline, Result

__all__ = ["Params", "Pipeline", "Result"]
__version__ = "0.1.0"
