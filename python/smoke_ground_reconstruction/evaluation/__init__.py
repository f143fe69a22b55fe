"""The experiments of the thesis: yardstick, baselines, runs over scenes, report and figures."""
