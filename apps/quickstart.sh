#!/bin/bash
# From a bare clone to images: installs what is missing, builds, generates a porous sample, compacts it, renders it.
# Everything goes to build/release and out/quickstart. Run again, it goes on where it stopped.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source apps/example_steps.sh

scene=assets/scenes/quickstart.toml
out=out/quickstart
run=$out/run

install_and_build

say "Microstructure: a level cut through a Gaussian random field, a few seconds"
mkdir -p "$out"
"$anticrack" generate "$scene" -o "$out/sample.vdb" --force

simulate "$scene" "$run" "compression between a platen and the floor, several minutes"

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
