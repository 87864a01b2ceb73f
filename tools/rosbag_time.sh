#!/usr/bin/env bash
# tools/rosbag_time.sh BAG [BUILD]: the processor time of reading a ROS 1 bag, by librosbag_storage and by Trundle, which
# decodes every field besides; five times each, in turn. Debian's packages of the library are unpacked into
# BUILD/rosbag_storage, not installed.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
bag=$1
build=${2:-$here/../build}
build=$(cd "$build" && pwd)
oracle=$build/rosbag_storage
mkdir -p "$oracle/root"
if [[ ! -d $oracle/root/usr/include/rosbag ]]; then
  mapfile -t packages < <(apt-get install -s --no-install-recommends librosbag-storage-dev | awk '/^Inst/ { print $2 }' |
    grep -v -E '^(python3|docutils)')
  (cd "$oracle" && apt-get download "${packages[@]}" >/dev/null && for package in *.deb; do dpkg -x "$package" root; done)
fi
library=$oracle/root/usr/lib/$(uname -m)-linux-gnu
includes=(-isystem "$oracle/root/usr/include")
for package in pluginlib class_loader rcpputils rcutils ament_index_cpp; do includes+=(-isystem "$oracle/root/usr/include/$package"); done
c++ -O2 -w "${includes[@]}" "$here/rosbag_time.cpp" -o "$oracle/rosbag_time" -L"$library" \
  -Wl,-rpath-link,"$library" -lrosbag_storage -lroscpp_serialization -lrostime -lcpp_common -lconsole_bridge \
  -lclass_loader -lrcpputils -lament_index_cpp -lroslib -l:libboost_filesystem.so.1.74.0
cmake --build "$build" --parallel 1 --target dump_log >&2
mkdir -p "$oracle/prefix" && ln -sfn "$library/ros" "$oracle/prefix/lib"  # where the library looks for its plugins
for _ in 1 2 3 4 5; do
  ROS_PACKAGE_PATH=$oracle/root/usr/share CMAKE_PREFIX_PATH=$oracle/prefix LD_LIBRARY_PATH=$library:$library/ros \
    "$oracle/rosbag_time" "$bag"
  TIMEFORMAT='Trundle, every field: %U s + %S s of the system'
  time "$build/tests/oracles/dump_log" "$bag" --quiet 2>/dev/null
done
