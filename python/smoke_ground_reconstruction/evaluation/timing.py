"""Where the time goes: the rows of the thesis's Table 5.2 from the pipeline's own clock."""

from smoke_ground_reconstruction.evaluation import printed

LIDAR_SECONDS = 0.10
"""One revolution at 10 Hz, which the thesis counts in."""

COMPONENTS = {
    "Denoiser": ("organise", "denoise"),
    "Ground and wall segmentation": ("segment",),
    "Ground surface reconstruction": ("cluster", "reconstruct", "rasterize"),
}
"""The pipeline's stages by component. Clustering counts as reconstruction: the thesis has no row
for it, and its segmentation's 5 ms leave no room for a KD-tree."""


def breakdown(stage_ms):
    """Net seconds of each component.

    Args:
        stage_ms: milliseconds by stage name, as Pipeline reports them.

    Returns:
        Seconds by component of COMPONENTS; "Full method" is their sum and the LiDAR's revolution.

    Raises:
        ValueError: a stage that no component names.
    """
    known = {stage for stages in COMPONENTS.values() for stage in stages}
    unknown = sorted(set(stage_ms) - known)
    if unknown:
        raise ValueError(f"no component of Table 5.2 holds the stages {', '.join(unknown)}")
    seconds = {"LiDAR": LIDAR_SECONDS}
    for component, stages in COMPONENTS.items():
        seconds[component] = 1e-3 * sum(stage_ms.get(stage, 0.0) for stage in stages)
    seconds["Full method"] = sum(seconds.values())
    return seconds


def printed_seconds(component):
    """The thesis's runtime of a component [s]; ground and wall segmentation are added up."""
    if component == "Ground and wall segmentation":
        return sum(
            printed.TABLE_5_2[row][0] for row in ("Ground segmentation", "Wall segmentation")
        )
    return printed.TABLE_5_2[component][0]


def table_5_2(stage_ms):
    """Rows of Table 5.2: component, seconds, Hz, share of the whole, printed seconds."""
    seconds = breakdown(stage_ms)
    whole = seconds["Full method"]
    return [
        {
            "component": component,
            "seconds": value,
            "hz": 1.0 / value if value > 0 else None,
            "share": value / whole,
            "printed_seconds": printed_seconds(component),
        }
        for component, value in seconds.items()
    ]
