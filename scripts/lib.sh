# Shared by the scripts in this folder; sourced, with the repository's root as working directory.

# The scripts' ROS processes are all on this machine; nothing that the caller has set leads elsewhere.
export ROS_HOSTNAME=localhost
unset ROS_IP
# rospy loads numpy, whose threads would keep the processor busy at the start of each node.
export OPENBLAS_NUM_THREADS=1
# A thousand processes begin, and each would compile all of its modules. What is left behind is ignored by git.
unset PYTHONDONTWRITEBYTECODE

# What catkin calls the interpreter of the nodes: before Debian 13, and from then on.
interpreter=("-DPYTHON_EXECUTABLE=$PWD/.venv/bin/python" "-DPython_EXECUTABLE=$PWD/.venv/bin/python")

# Says what comes next, and how long the script has run, in minutes and seconds.
say() {
  printf '\033[1m[%s %d:%02d] %s\033[0m\n' "$(basename "$0")" $((SECONDS / 60)) $((SECONDS % 60)) "$*"
}

fail() {
  printf '[%s] %s\n' "$(basename "$0")" "$*" >&2
  exit 1
}

# What ROS calls the packages of the system at hand.
is_noetic() {
  [ -d /opt/ros/noetic ] || grep -qs '^VERSION_CODENAME=focal' /etc/os-release
}

# Prints the apt packages that building and running need.
apt_packages() {
  if is_noetic; then
    echo ros-noetic-ros-base ros-noetic-actionlib \
      ros-noetic-actionlib-msgs ros-noetic-message-generation ros-noetic-message-runtime \
      ros-noetic-rosbag ros-noetic-rostest ros-noetic-std-msgs ros-noetic-std-srvs \
      ros-noetic-diagnostic-updater \
      ros-noetic-geometry-msgs ros-noetic-move-base-msgs ros-noetic-nav-msgs ros-noetic-rosgraph-msgs \
      ros-noetic-sensor-msgs ros-noetic-tf2-msgs ros-noetic-visualization-msgs
  else
    echo catkin ros-base ros-environment rosbash python3-rospy \
      python3-actionlib libactionlib-dev libactionlib-msgs-dev libstd-msgs-dev ros-actionlib-msgs ros-std-msgs \
      ros-message-generation ros-message-runtime python3-rosbag librostest-dev python3-rostest \
      ros-geometry-msgs ros-move-base-msgs ros-nav-msgs ros-rosgraph-msgs \
      ros-sensor-msgs ros-tf2-msgs ros-visualization-msgs ros-std-srvs \
      ros-diagnostic-msgs python3-diagnostic-msgs python3-diagnostic-updater \
      python3-geometry-msgs python3-move-base-msgs python3-nav-msgs python3-rosgraph-msgs \
      python3-sensor-msgs python3-tf2-msgs python3-visualization-msgs python3-std-srvs
  fi
  echo build-essential cmake cython3 python3-dev python3-venv
  # What cv_bridge and others of apt are built for; pip gets what apt's are too old for.
  echo python3-aiohttp python3-cffi python3-defusedxml python3-hypothesis python3-lz4 python3-numpy python3-pil \
    python3-ruamel.yaml python3-scipy python3-shapely python3-skimage
  # ROS looks up localhost and the machine's own name, which not every /etc/hosts has.
  getent -s files hosts localhost "$(uname -n)" >/dev/null || echo libnss-myhostname
}

# Prints the apt packages that are recommended: for pictures, and OpenGL without a display for the camera of the simulator
# with MuJoCo.
apt_packages_recommended() {
  echo python3-matplotlib libegl1 libgl1 libgl1-mesa-dri
}

# Prints the apt packages that only tests need.
apt_packages_for_tests() {
  if is_noetic; then
    echo ros-noetic-cv-bridge ros-noetic-rviz
  else
    echo python3-cv-bridge rviz chromium chromium-driver
  fi
  # A display without a screen, and what takes pictures of it.
  echo imagemagick xvfb
}

# Prints the apt packages that only scripts/package needs. Of what is for Python, the Debian packages take from apt what
# is here; they bring along the rest.
apt_packages_for_packages() {
  echo debhelper dh-python dpkg-dev fakeroot lintian python3-all python3-catkin-pkg python3-setuptools
}

# Installs apt packages that are missing.
install_with_apt() {
  local package missing=() sudo=()
  for package in "$@"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" = installed ] ||
      missing+=("$package")
  done
  [ ${#missing[@]} -gt 0 ] || return 0
  say "installing with apt: ${missing[*]}"
  [ "$(id -u)" = 0 ] || sudo=(sudo)
  "${sudo[@]}" apt-get update -q
  "${sudo[@]}" env DEBIAN_FRONTEND=noninteractive \
    apt-get install -q -y --no-install-recommends "${missing[@]}" ||
    fail "apt cannot install what is missing. On Ubuntu 20.04, add ROS Noetic's package source" \
      "first, as ROS's installation page says; Debian 12 and 13 need no other source than their own."
}

# Builds the workspace. Further arguments go to catkin_make, such as the target install.
build() {
  if [ -f /opt/ros/noetic/setup.bash ]; then
    source_ros /opt/ros/noetic/setup.bash
  fi
  # Its own folders only: a workspace that the caller has sourced must not leak into this one.
  catkin_make --source . "${interpreter[@]}" \
    -DCMAKE_PREFIX_PATH="$([ -d /opt/ros/noetic ] && echo /opt/ros/noetic)" "$@"
}

# ROS's setup files use variables that are not set.
source_ros() {
  set +u
  # shellcheck disable=SC1090
  source "$1"
  set -u
}

# Runs a command, and shows what it printed only if it fails.
quietly() {
  local log
  log=$(mktemp)
  "$@" >"$log" 2>&1 || { cat "$log"; rm -f "$log"; fail "$1 failed"; }
  rm -f "$log"
}
