#!/bin/bash
# Long soak: crushes the quickstart's 2.1e5 particles by 80 %, far past full compaction, on one thread with all
# outputs, and looks at the memory of the process every five seconds. Tens of minutes; fewer on an idle, fast machine.
#   bash tests/soak.sh [DIR]     exit status 0 if memory stays flat and the energy balance closes
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
anticrack=build/release/anticrack
out=${1:-out/soak}

mkdir -p "$out"
"$anticrack" run assets/scenes/quickstart.toml -o "$out/run" --threads 1 --force \
  --set loading.until_strain=0.8 &
process=$!
trap 'kill "$process" 2>/dev/null || true' EXIT

echo "seconds,resident_kib,peak_kib" > "$out/memory.csv"
while kill -0 "$process" 2>/dev/null; do
  awk -v t=$SECONDS '/^VmRSS/ { now = $2 } /^VmHWM/ { peak = $2 } END { if (now) print t "," now "," peak }' \
    "/proc/$process/status" 2>/dev/null >> "$out/memory.csv" || true
  sleep 5
done
trap - EXIT
wait "$process"

status=0
# Flat: the second half never needs 2 % more than the first half did.
awk -F, -v minutes=$((SECONDS / 60)) '
  NR > 1 { resident[++n] = $2; peak = $3; if ($1 >= 60 && !settled) settled = $2 }
  END {
    for (i = 1; i <= n; ++i) if (resident[i] > most[i > n / 2]) most[i > n / 2] = resident[i]
    printf "%d minutes; resident memory: after a minute %.1f, last %.1f, peak %.1f MiB; most in the first half %.1f, in the second %.1f MiB\n",
           minutes, settled / 1024, resident[n] / 1024, peak / 1024, most[0] / 1024, most[1] / 1024
    exit !(most[1] < 1.02 * most[0])
  }' "$out/memory.csv" || status=1
# Closed: as for every run to jamming, at most 5 % of the work is missing in any row.
awk -F, '
  NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
  { last = $column["energy_residual"]; size = last < 0 ? -last : last; if (size > worst) worst = size }
  END {
    printf "%d steps to strain %.3f, solid fraction %.2f; energy residual: worst row %.3f %%, last row %.3f %%\n",
           $column["step"], -$column["strain_y"], $column["solid_fraction"], 100 * worst, 100 * last
    exit !(worst < 0.05)
  }' "$out/run/history.csv" || status=1
exit "$status"
