#!/bin/sh
# Solves the same elastic blocks with this program and with CHOLMOD ordered by METIS, one after the other, on the
# same number of threads, and prints seconds and ratios.
# Usage: benches/compare-cholmod.sh [threads] [rounds]. Needs cc, libsuitesparse-dev and libopenblas-dev (Debian).
set -eu
threads=${1:-2}
rounds=${2:-3}
cd "$(dirname "$0")/.."
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
if ! cc -O2 benches/cholmod.c -o "$folder/cholmod" -lcholmod -lopenblas -lm; then
    echo "CHOLMOD is not installed: apt-get install libsuitesparse-dev libopenblas-dev" >&2
    exit 1
fi
ours=$(cargo bench --bench against_cholmod --no-run 2>&1 | sed -n 's/.*Executable.*(\(.*\)).*/\1/p')
echo "solver nodes analyse/s factor/s solve/s solve32/s entries residual"
for cells in "40 29 7" "76 50 12"; do
    # shellcheck disable=SC2086
    RAYON_NUM_THREADS=$threads "$ours" $cells "$folder/matrix" "$rounds" | tee "$folder/ours"
    OPENBLAS_NUM_THREADS=$threads OMP_NUM_THREADS=$threads "$folder/cholmod" "$folder/matrix" "$rounds" | tee "$folder/cholmod.txt"
    cat "$folder/ours" "$folder/cholmod.txt" | awk '
        { for (i = 3; i <= 6; i++) t[NR, i] = $i; all[NR] = $3 + $4 + $5 }
        END {
            printf "ratio: analyse %.2f factor %.2f solve %.2f solve32 %.2f | analyse + factor + solve %.2f\n",
                t[1, 3] / t[2, 3], t[1, 4] / t[2, 4], t[1, 5] / t[2, 5], t[1, 6] / t[2, 6], all[1] / all[2]
        }'
done
