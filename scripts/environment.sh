# Sourced by the scripts beside it: where things are, and ROS's own interpreter first in PATH.

root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
build=$root/build

# A build elsewhere (another clone, CI) may take what this one compiled.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1

# ROS's Python packages belong to /usr/bin/python3; a pyenv or conda python3 must not come first.
export PATH="/usr/bin:/bin:$PATH"

fail() {
  echo "$(basename "$0"): $*" >&2
  exit 1
}

# Ubuntu keeps ROS in /opt; Debian has it in /usr, where nothing is to be set.
use_ros() {
  if [ -e /opt/ros/noetic/setup.bash ]; then
    set +u
    . /opt/ros/noetic/setup.bash
    set -u
  fi
}

# The build's own space before ROS's, so that nothing needs to be sourced by hand.
use_build() {
  use_ros
  export CMAKE_PREFIX_PATH="$build/devel${CMAKE_PREFIX_PATH:+:$CMAKE_PREFIX_PATH}"
  export ROS_PACKAGE_PATH="$root:${ROS_PACKAGE_PATH:-/usr/share}"
  export LD_LIBRARY_PATH="$build/devel/lib${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH}"
  export PYTHONPATH="$build/devel/lib/python3/dist-packages${PYTHONPATH:+:$PYTHONPATH}"
}
