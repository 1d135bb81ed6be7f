#!/usr/bin/env bash
# Prints, for several beliefs about the noise, how often and how well eta initializes after VI-BA, whether its covariances are
# as large as its errors (medians of the NEES per degree of freedom), and chi2/dof of gyro, accelerometer and pixels.
#
#   scripts/measure_noise_factors.sh OUT SRC...        -- OUT keeps tracks and results; EVERY=1 for a window a second
#   BELIEFS="0.025,0.05,0.29,2.2,6,1,3 0.001,0.0001,0.5,1.5,6"    -- sigma_shared_deg,sigma_turn_deg,sigma_px,gyro factor,accelerometer
#                                                                    factor[,least of the gyro,of the accelerometer]
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
[[ $# -ge 2 ]] || { sed -n '2,7p' "$0"; exit 2; }
etalon=${ETALON_BINARY:-$here/build/release/bin/etalon}
out=$1
shift
mkdir -p "$out"
printf '%-30s %-18s %7s %8s %7s %9s %8s %6s %6s   %s\n' "belief" recording success "RRE deg" "ATE mm" "v m/s" gravity \
  tilt velocity "chi2/dof gyro, accelerometer, vision"
defaults="0.001,0.0001,0.5,1.5,6 0.015,0.0001,0.29,2.2,6,2.2,3 0.025,0.0001,0.29,2.2,6,2.2,3 0.025,0.05,0.29,2.2,6,2.2,3
  0.015,0.05,0.29,2.2,6,1,3 0.025,0.1,0.29,2.2,6,1,3 0.025,0.05,0.29,2.2,3.3,1 0.025,0.05,0.29,2.2,6,1 0.025,0.05,0.29,2.2,6,1,3"
for belief in ${BELIEFS:-$defaults}; do
  IFS=, read -r shared turn px gyro accel least_gyro least_accel <<<"$belief"
  "$etalon" bench "$@" --initializers eta --every "${EVERY:-2.5}" --tracks "$out/tracks" --out "$out/$belief" --overwrite --format csv \
    --set "vi_ba.sigma_shared_deg=$shared" --set "vi_ba.sigma_turn_deg=$turn" --set "odometry.sigma_px=$px" \
    --set "imu_noise.gyro_noise_factor=$gyro" --set "imu_noise.min_gyro_noise_factor=${least_gyro:-$gyro}" \
    --set "imu_noise.accel_noise_factor=$accel" --set "imu_noise.min_accel_noise_factor=${least_accel:-$accel}" >"$out/$belief.csv" 2>"$out/$belief.log" || { cat "$out/$belief.log" >&2; exit 1; }
  awk -F, -v belief="$belief" '
    $5 == "all" && $8 == "vi_ba" && ($2 == "median" || $1 == "success" || $1 ~ /^noise_.*chi2/) {
      value[$6, $1] = $10
      if (!($6 in seen)) { seen[$6]; order[++count] = $6 }
    }
    END {
      for (i = 1; i <= count; i++) {
        r = order[i]
        printf "%-30s %-18s %7.3f %8.4f %7.3f %9.4f %8.3f %6.2f %6.2f   %.2f, %.2f, %.2f\n", belief, r, value[r, "success"], \
          value[r, "rre_deg"], 1000 * value[r, "ate_m"], value[r, "velocity_mps"], value[r, "gravity_deg"], value[r, "tilt_nees"], \
          value[r, "velocity_nees"], value[r, "noise_gyro_chi2_per_dof"], value[r, "noise_accel_chi2_per_dof"], \
          value[r, "noise_vision_chi2_per_dof"]
      }
    }' "$out/$belief.csv"
done
