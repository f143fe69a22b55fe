"""The method in NumPy, one module a stage, written to be read beside the thesis.

Modules, classes, functions and parameters carry the names of the C++ headers; the decisions are
the same to the last bit (see :mod:`.predicates`). Nothing here calls the compiled module.

======================= ==================================================
module                  thesis
======================= ==================================================
agdor_filter            Section 3.2, Algorithm 1
channel_segmentation    Section 3.3, Algorithm 4
wall_clustering         Section 3.3, "Clustering"
polar_segments          Section 3.4, Eq. 3.1, Algorithms 3 and 5
room_boundary           ours, against the limits of Section 6.2
======================= ==================================================

Under ``room_boundary`` lie ``floor_model``, ``room`` (with ``wall_profile``, ``floor_relief``,
``drop_offs``, ``visibility``) and ``floor_completion`` (with ``confidence``).
Under them all lie ``scan`` (the points laid out once), ``sensor_model`` (rings by elevation) and
``azimuth_bins`` (columns and segments); ``pipeline`` runs the stages in order.
"""
