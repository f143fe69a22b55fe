"""Scans and floors in whatever file: bags need ROS's Python packages, the rest does not."""

from typing import Iterable, List, Optional, Sized

from smoke_ground_reconstruction.io import DataError, clouds, format_of, npz, pcd
from smoke_ground_reconstruction.io.clouds import Floor, LidarScan


def open_scans(path: str, topic: Optional[str] = None, index: Optional[int] = None) -> Sized:
    """The scans of a file: an iterable with a length that can be gone through again and again.

    Parameters
    ----------
    path : `.bag`, `.npz` or `.pcd`
    topic : topic of the clouds, for bags with several
    index : only this scan, 0 the first; None: all

    Raises
    ------
    DataError : what is wrong with the file, the topic or the index.
    """
    if format_of(path) == ".bag":
        from smoke_ground_reconstruction.io import bag

        return bag.Scans(path, topic, index)
    _refuse_choice(path, index, topic)
    return [_single(path).read_scan(path)]


def holds_floors(path: str) -> bool:
    """Is this a result (rather than scans)?"""
    if format_of(path) == ".bag":
        from smoke_ground_reconstruction.io import bag

        return bag.holds_floors(path)
    columns = npz.read_arrays(path) if format_of(path) == ".npz" else pcd.read_fields(path)
    return clouds.is_floor(columns)


def open_floors(path: str, index: Optional[int] = None) -> Sized:
    """The floors of a file, as `open_scans`."""
    if format_of(path) == ".bag":
        from smoke_ground_reconstruction.io import bag

        return bag.Floors(path, index)
    _refuse_choice(path, index)
    return [_single(path).read_floor(path)]


def write_scans(path: str, scans: Iterable[LidarScan]) -> None:
    """Writes scans; `.npz` and `.pcd` take exactly one (`check_room`)."""
    if format_of(path) == ".bag":
        from smoke_ground_reconstruction.io import bag

        bag.write_scans(path, scans)
        return
    for scan in scans:
        _single(path).write_scan(path, scan)


def write_floors(path: str, floors: Iterable[Floor]) -> None:
    """Writes floors; `.npz` and `.pcd` take exactly one (`check_room`)."""
    if format_of(path) == ".bag":
        from smoke_ground_reconstruction.io import bag

        with bag.FloorWriter(path) as writer:
            for floor in floors:
                writer.add_floor(floor)
        return
    for floor in floors:
        _single(path).write_floor(path, floor)


def check_room(source: str, items: Sized, target: str, names: List[str]) -> None:
    """Refuses to put several scans into a file that holds one.

    Raises
    ------
    DataError : says how to choose one; or that there is none.
    """
    one, many = names
    if len(items) == 0:
        raise DataError(f"{source}: no {one} in it")
    if len(items) > 1 and format_of(target) != ".bag":
        raise DataError(
            f"{source} has {len(items)} {many} and {target} holds one: choose it by --scan "
            f"(0 to {len(items) - 1}), or write a .bag"
        )


def _single(path: str):
    return npz if format_of(path) == ".npz" else pcd


def _refuse_choice(path: str, index: Optional[int], topic: Optional[str] = None) -> None:
    if index not in (None, 0):
        raise DataError(f"{path}: no scan {index}; it holds one, scan 0")
    if topic is not None:
        raise DataError(f"{path}: --topic is for bags")
