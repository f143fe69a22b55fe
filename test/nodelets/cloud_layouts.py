"""PointCloud2 messages as LiDAR drivers lay them out, for tests."""

import numpy as np
from sensor_msgs.msg import PointCloud2, PointField

_XYZ = [("x", "<f4", 0), ("y", "<f4", 4), ("z", "<f4", 8)]
# name -> (fields as (name, dtype, offset), point_step)
LAYOUTS = {
    "hesai_ros2": (
        [*_XYZ, ("intensity", "<f4", 12), ("ring", "<u2", 16), ("timestamp", "<f8", 18)],
        26,
    ),
    "hesai_general": (
        [*_XYZ, ("intensity", "<f4", 16), ("timestamp", "<f8", 24), ("ring", "<u2", 32)],
        48,
    ),
    "ouster_original": (
        [
            *_XYZ,
            ("intensity", "<f4", 16),
            ("t", "<u4", 20),
            ("reflectivity", "<u2", 24),
            ("ring", "<u2", 26),
            ("ambient", "<u2", 28),
            ("range", "<u4", 32),
        ],
        48,
    ),
    "ouster_xyzir": ([*_XYZ, ("intensity", "<f4", 16), ("ring", "<u2", 20)], 32),
    "velodyne": ([*_XYZ, ("intensity", "<f4", 12), ("ring", "<u2", 16), ("time", "<f4", 18)], 22),
    "rslidar_xyzirt": (
        [*_XYZ, ("intensity", "<f4", 12), ("ring", "<u2", 16), ("timestamp", "<f8", 18)],
        26,
    ),
    "rslidar_older": (
        [*_XYZ, ("intensity", "<f4", 16), ("ring", "<u2", 20), ("timestamp", "<f8", 24)],
        32,
    ),
    "rslidar_xyzi": ([*_XYZ, ("intensity", "<f4", 12)], 16),
    # Types that other drivers use.
    "ring_u8": ([*_XYZ, ("intensity", "<u1", 12), ("ring", "<u1", 13)], 14),
    "ring_u32": ([*_XYZ, ("ring", "<u4", 12), ("intensity", "<u2", 16)], 18),
    "ring_i16": (
        [
            ("ring", "<i2", 0),
            ("x", "<f4", 2),
            ("y", "<f4", 6),
            ("z", "<f4", 10),
            ("intensity", "<i4", 14),
        ],
        19,
    ),
    "double": (
        [
            ("x", "<f8", 0),
            ("y", "<f8", 8),
            ("z", "<f8", 16),
            ("intensity", "<f8", 24),
            ("ring", "<i4", 32),
        ],
        36,
    ),
}

_DATATYPES = {
    "<i1": PointField.INT8,
    "<u1": PointField.UINT8,
    "<i2": PointField.INT16,
    "<u2": PointField.UINT16,
    "<i4": PointField.INT32,
    "<u4": PointField.UINT32,
    "<f4": PointField.FLOAT32,
    "<f8": PointField.FLOAT64,
}


def cloud_of(layout, header, xyz, intensity, ring, rows=1, padding=0):
    """A cloud in a driver's layout; fields without a value here hold 1, 2, 3, ...

    Parameters
    ----------
    rows : int
        Height of the organised cloud; divides the number of points.
    padding : int
        Bytes after each row.
    """
    fields, step = LAYOUTS[layout]
    dtype = np.dtype(
        {
            "names": [name for name, _, _ in fields],
            "formats": [dtype for _, dtype, _ in fields],
            "offsets": [offset for _, _, offset in fields],
            "itemsize": step,
        }
    )
    points = np.zeros(len(xyz), dtype)
    values = {"x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2], "intensity": intensity, "ring": ring}
    for name, form, _ in fields:
        filler = np.arange(1, len(xyz) + 1).astype(form)
        points[name] = np.asarray(values.get(name, filler)).astype(form)
    columns = len(xyz) // rows
    raw = np.frombuffer(points.tobytes(), np.uint8).reshape(rows, columns * step)
    raw = np.pad(raw, ((0, 0), (0, padding)), constant_values=0xAB)
    return PointCloud2(
        header=header,
        height=rows,
        width=columns,
        fields=[PointField(n, offset, _DATATYPES[d], 1) for n, d, offset in fields],
        is_bigendian=False,
        point_step=step,
        row_step=columns * step + padding,
        data=raw.tobytes(),
        is_dense=False,
    )
