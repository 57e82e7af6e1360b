#!/bin/bash
# The tests under the thread sanitizer, with a oneTBB that is built for it too: Debian's hides that a task starts after
# its spawn and ends before the wait, so that every parallel loop would read as a race. Without oneTBB's own allocator, too:
# what it hands from thread to thread the sanitizer does not see freed.
#   bash tests/tsan.sh [CTEST OPTIONS]     for example -R Simulation
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source apps/debian_packages.sh
install_packages "${build_packages[@]}" "${test_packages[@]}" dpkg-dev

tbb=$PWD/build/tsan_tbb
if [ ! -e "$tbb/done" ]; then
  rm -rf "$tbb" && mkdir -p "$tbb/lists/partial" "$tbb/source"
  echo "deb-src http://deb.debian.org/debian bookworm main" > "$tbb/sources.list"
  apt_source=(apt-get -q -o Dir::Etc::SourceList="$tbb/sources.list" -o Dir::Etc::SourceParts=/dev/null -o Dir::State::Lists="$tbb/lists")
  "${apt_source[@]}" update
  (cd "$tbb/source" && "${apt_source[@]}" source --download-only onetbb && tar xf onetbb_*.orig.tar.*)
  cmake -S "$tbb"/source/oneTBB-* -B "$tbb/build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_TEST=OFF -DTBB_STRICT=OFF \
    -DTBBMALLOC_BUILD=OFF -DCMAKE_CXX_FLAGS=-fsanitize=thread
  cmake --build "$tbb/build"
  touch "$tbb/done"
fi

cmake --preset tsan -DANTICRACK_TESTS=ON
cmake --build build/tsan
TSAN_OPTIONS=suppressions=$PWD/tests/tsan_suppressions.txt \
  LD_LIBRARY_PATH=$(dirname "$(find "$tbb/build" -name libtbb.so.12)") ctest --preset tsan "$@"
