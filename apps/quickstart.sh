#!/bin/bash
# From a bare clone to images: installs what is missing, builds, generates a porous sample, compacts it, renders it.
# Everything goes to build/release and out/quickstart. Run again, it goes on where it stopped.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source apps/debian_packages.sh

scene=assets/scenes/quickstart.toml
out=out/quickstart
run=$out/run
anticrack=build/release/anticrack

say() { printf '== [%d min %02d s] %s\n' $((SECONDS / 60)) $((SECONDS % 60)) "$*"; }

say "Packages: a minute or two if any are missing"
install_packages "${build_packages[@]}"

say "Building $anticrack: about six minutes on two cores the first time"
tests=()
[ -f build/release/CMakeCache.txt ] || tests=(-DANTICRACK_TESTS=OFF)
cmake --preset release "${tests[@]}" --log-level=WARNING
cmake --build build/release --target anticrack

say "Microstructure: a level cut through a Gaussian random field, a few seconds"
mkdir -p "$out"
"$anticrack" generate "$scene" -o "$out/sample.vdb" --force

simulate() {
  local status=0
  "$anticrack" run "$scene" -o "$run" "$@" || status=$?
  [ "$status" -ne 75 ] || say "Stopped. Run this script again to go on."
  return "$status"
}
if [ -f "$run/result.json" ] && [ "$run/result.json" -nt "$scene" ] && [ "$run/result.json" -nt "$anticrack" ]; then
  say "Simulation: done before"
elif compgen -G "$run/checkpoint/*.bin" >/dev/null && [ ! -f "$run/result.json" ] && [ "$run/scene.toml" -nt "$scene" ]; then
  say "Simulation: going on from the last checkpoint"
  simulate --resume
else
  say "Simulation: compression between a platen and the floor, several minutes"
  simulate --force
fi

say "Images: half a minute each"
for frame in 3 12 24 last; do
  "$anticrack" render "$run" --frame "$frame" --field kappa -o "$out/plastic_strain_$frame.png"
done
"$anticrack" render "$run" --panel --strains 0.02,0.1,0.2,0.3 --field velocity_y -o "$out/velocity_panel.png"
"$anticrack" render "$run" --plot --x=-strain_y --y p,q -o "$out/stress_strain.png"
"$anticrack" render "$run" --renderer osmesa -o "$out/preview.png"

say "Done. Look at:"
ls -1 "$out"/*.png
echo "The run itself: $run; open $run/frames/frames.pvd in ParaView. What is in it: $anticrack info $run"
