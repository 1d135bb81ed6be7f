#!/usr/bin/env bash
# Plots the tables of etalon_predicted_errors (standard input) as SVG (standard output): errors as discs, what was predicted as lines.
#
#   etalon_predicted_errors | tee tables.md | scripts/plot_predicted_errors.sh > errors.svg
set -euo pipefail
[[ $# -eq 0 ]] || { sed -n '2,4p' "$0"; exit 2; }
awk -F ' *\\| *' '
  function log10(x) { return log(x) / log(10) }
  function height(q, v) { return top[q] + 150 * (1 - (log10(v) - low[q]) / (high[q] - low[q])) }
  /^\|---/ { next }
  /^\|/ && $3 ~ /^estimates/ { ++tables; title[tables] = $2; next }
  /^\|/ {
    n = ++rows[tables]; label[tables, n] = $2
    error[1, tables, n] = $6 + 0; predicted[1, tables, n] = $7 + 0  # 0: a row without estimates
    error[2, tables, n] = $9 + 0; predicted[2, tables, n] = $10 + 0
    for (q = 1; q <= 2; q++)
      for (k = 0; k < 2; k++) {
        v = k ? predicted[q, tables, n] : error[q, tables, n]
        if (!(v > 0)) continue
        if (!(q in least) || v < least[q]) least[q] = v
        if (v > most[q]) most[q] = v
      }
  }
  END {
    name[1] = "gravity, deg"; name[2] = "velocity, m/s"
    width = 70 + 190 * tables
    printf "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"%d\" height=\"440\" font-family=\"sans-serif\" font-size=\"11\">\n", width
    printf "<rect width=\"%d\" height=\"440\" fill=\"white\"/>\n", width
    for (q = 1; q <= 2; q++) {
      top[q] = 30 + 190 * (q - 1)
      low[q] = int(log10(least[q]) - 1); high[q] = int(log10(most[q]) + (most[q] > 1))
      printf "<text transform=\"translate(14 %d) rotate(-90)\" text-anchor=\"middle\">%s</text>\n", top[q] + 75, name[q]
      for (d = low[q]; d <= high[q]; d++)
        printf "<path d=\"M60 %.1fH%d\" stroke=\"#ddd\"/><text x=\"56\" y=\"%.1f\" text-anchor=\"end\">%g</text>\n", height(q, 10 ^ d), width - 10, height(q, 10 ^ d) + 4, 10 ^ d
      for (t = 1; t <= tables; t++) {
        line = ""
        for (n = 1; n <= rows[t]; n++) {
          x = 60 + 190 * (t - 1) + 180 * (n - 0.5) / rows[t]
          if (predicted[q, t, n] > 0) line = line sprintf("%.1f,%.1f ", x, height(q, predicted[q, t, n]))
          if (error[q, t, n] > 0) printf "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"#d62728\"/>\n", x, height(q, error[q, t, n])
          if (q == 2) printf "<text x=\"%.1f\" y=\"388\" text-anchor=\"middle\">%s</text>\n", x, (label[t, n] + 0 == 1e6 ? "inf" : label[t, n])
        }
        printf "<polyline points=\"%s\" fill=\"none\" stroke=\"#1f77b4\" stroke-width=\"2\"/>\n", line
        if (q == 2) printf "<text x=\"%d\" y=\"406\" text-anchor=\"middle\">%s</text>\n", 150 + 190 * (t - 1), title[t]
      }
    }
    print "<circle cx=\"70\" cy=\"426\" r=\"4\" fill=\"#d62728\"/><text x=\"80\" y=\"430\">error, root mean square</text>"
    print "<path d=\"M230 426h24\" stroke=\"#1f77b4\" stroke-width=\"2\"/><text x=\"260\" y=\"430\">predicted</text>"
    print "</svg>"
  }'
