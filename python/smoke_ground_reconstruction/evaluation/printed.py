"""Numbers that the thesis prints, to set beside ours. Nothing is computed from them."""

TABLE_5_1 = {
    "Point cloud without smoke": (0.95, 0.95, 0.99, 0.97, 0.95),
    "Point cloud in smoke": (0.99, 0.69, 0.63, 0.77, 0.63),
    "Reconstructed ground surface in smoke": (0.97, 0.86, 0.86, 0.91, 0.84),
}
"""Precision, accuracy, recall, F1 and IoU by classification grid."""

TABLE_5_1_COLUMNS = ("precision", "accuracy", "recall", "f1", "iou")

HEIGHT_MEAN = -0.027
HEIGHT_MEDIAN = -0.023
"""Height of the reconstructed floor minus the true one over all cells [m], Section 5.2.2."""

TABLE_5_2 = {
    "LiDAR": (0.10, 10.0, 0.040),
    "Denoiser": (1.48, 0.7, 0.592),
    "Ground segmentation": (0.01, 196.9, 0.002),
    "Wall segmentation": (0.01, 196.9, 0.002),
    "Ground surface reconstruction": (0.91, 1.1, 0.364),
    "Full method": (2.50, 0.40, 1.0),
}
"""Runtime [s], rate [Hz] and share of the whole by component, on a Jetson Orin Nano."""
