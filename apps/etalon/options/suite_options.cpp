#include "options/suite_options.h"

#include <cstdio>

#include "etalon/core/errors.h"
#include "etalon/report/table.h"
#include "support/checks.h"

namespace etalon::app {

void SuiteOptions::add(CLI::App* command, const Texts& texts) {
  command->add_option("--jobs", jobs, texts.jobs)
      ->check(CLI::Range(1, 1024, "a whole number from 1 to 1024"))
      ->capture_default_str();
  addTimeLimitOption(command, texts.time_limit, &time_limit_s);
  command->add_option("--out", out, "Folder for the results")
      ->check(checkOutputPath())
      ->capture_default_str();
  command->add_option("--shard", shard, "Do part K of N only; `etalon merge` joins the parts")
      ->type_name("K/N")
      ->capture_default_str();
  command->add_flag("--overwrite", overwrite, "Begin anew: discard the results in the folder");
  command->add_option("--format", format, texts.format)
      ->check(CLI::IsMember(tableFormatNames()))
      ->capture_default_str();
  command->add_flag("-v,--verbose", verbose, texts.verbose);
}

void readShard(const std::string& text, int* shard, int* shards) {
  char rest = 0;
  if (std::sscanf(text.c_str(), "%d/%d%c", shard, shards, &rest) != 2 || *shard < 1 ||
      *shards < *shard)
    throw ConfigError("--shard: expected K/N with 1 <= K <= N, e.g. 2/8, found '" + text + "'");
}

}  // namespace etalon::app
