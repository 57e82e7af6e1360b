#!/bin/bash
# Installs what is missing, builds everything in build/release, runs all tests. Exit status 0 if all pass.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source apps/debian_packages.sh

install_packages "${build_packages[@]}" "${test_packages[@]}"

echo "== Building"
cmake --preset release -DANTICRACK_TESTS=ON -DANTICRACK_RENDER=ON --log-level=WARNING
cmake --build build/release

echo "== Testing"
# Each test process may use all cores itself, so no more of them than cores at once.
log=$(mktemp)
trap 'rm -f "$log"' EXIT
status=0
ctest --test-dir build/release --output-on-failure --progress -j "$(nproc)" 2>&1 | tee "$log" || status=$?

# The closing line of ctest, so that it is the last thing that one reads.
total=$(sed -n 's/^.* tests failed out of \([0-9]*\)$/\1/p' "$log" | tail -n 1)
failed=$(sed -n 's/^.*, \([0-9]*\) tests\{0,1\} failed out of .*$/\1/p' "$log" | tail -n 1)
if [ -z "$total" ] || [ "$total" -eq 0 ]; then
  echo "== No tests were run"
  exit 1
fi
echo "== $((total - failed)) of $total tests passed"
exit "$status"
