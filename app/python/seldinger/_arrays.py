"""numpy.typing.NDArray, for NumPy before 1.21 too, which has none."""

from typing import TYPE_CHECKING, List

if TYPE_CHECKING:
    from numpy.typing import NDArray as NDArray
else:
    try:
        from numpy.typing import NDArray
    except ImportError:
        NDArray = List
