#include "etalon/contract/contract.h"

#include <algorithm>
#include <cstdlib>
#include <string>

#include "check_tools.h"
#include "etalon/core/errors.h"
#include "etalon/core/text.h"

namespace etalon {

namespace {

using contract::CheckEntry;
using Verdict = ContractCheck::Verdict;

constexpr char kExact[] = "exact.";
constexpr char kSomewhere[] = "exact.somewhere";
constexpr char kTime[] = "time";

std::vector<CheckEntry> allChecks() {
  std::vector<CheckEntry> checks;
  const auto append = [&checks](std::vector<CheckEntry> more) {
    checks.insert(checks.end(), more.begin(), more.end());
  };
  append(contract::interfaceChecks());
  append(contract::exactnessChecks());
  append(contract::samenessChecks());
  append(contract::robustnessChecks());
  append(contract::covarianceChecks());
  return checks;
}

bool startsWith(const std::string& text, const std::string& start) {
  return text.compare(0, start.size(), start) == 0;
}

bool matches(const std::string& name, const std::string& wanted) {
  return name == wanted || (!wanted.empty() && wanted.back() == '.' && startsWith(name, wanted));
}

void checkNames(const std::vector<CheckEntry>& checks, const std::vector<std::string>& only) {
  for (const std::string& wanted : only) {
    const bool known = std::any_of(checks.begin(), checks.end(), [&](const CheckEntry& c) {
      return matches(c.description.name, wanted);
    });
    if (known) continue;
    std::vector<std::string> names;
    for (const CheckEntry& c : checks) names.push_back(c.description.name);
    const bool of_exact = wanted + "." == kExact || wanted == kSomewhere;
    const std::string nearest = of_exact ? kExact : nearestWord(wanted, names);
    throw ConfigError("the contract has no check '" + wanted + "'" +
                      (nearest.empty() ? "" : " (did you mean '" + nearest + "'?)"));
  }
}

ContractCheck runHere(const CheckEntry& entry, const Initializer& initializer,
                      const ContractOptions& options) {
  try {
    return entry.run(initializer, options);
  } catch (const std::exception& e) {
    return contract::failed(std::string("threw: ") + e.what());
  } catch (...) {
    return contract::failed("threw what is no std::exception");
  }
}

// A check on its way through the pipe: verdict, value, number of failures, then each text (detail,
// failures, by_motion) after its length.
std::string packed(const ContractCheck& check) {
  const std::string head =
      format("%d %a %zu", static_cast<int>(check.verdict), check.value, check.failures.size());
  std::string text = head;
  const auto append = [&text](const std::string& more) {
    text += " " + std::to_string(more.size()) + " " + more;
  };
  append(check.detail);
  for (const auto* texts : {&check.failures, &check.by_motion})
    for (const std::string& more : *texts) append(more);
  return text;
}

ContractCheck unpacked(const std::string& text) {
  ContractCheck check;
  const char* const end = text.data() + text.size();
  char* rest = nullptr;
  check.verdict = static_cast<Verdict>(std::strtol(text.c_str(), &rest, 10));
  check.value = std::strtod(rest, &rest);
  const size_t failures = std::strtoul(rest, &rest, 10);
  std::vector<std::string> texts;
  while (rest < end) {
    const size_t size = std::strtoul(rest, &rest, 10);
    if (rest == end) break;
    ++rest;  // the blank
    texts.emplace_back(rest, std::min(size, static_cast<size_t>(end - rest)));
    rest += texts.back().size();
  }
  if (texts.size() < 1 + failures) return check;
  const auto by_motion = texts.begin() + 1 + static_cast<std::ptrdiff_t>(failures);
  check.detail = texts.front();
  check.failures.assign(texts.begin() + 1, by_motion);
  check.by_motion.assign(by_motion, texts.end());
  return check;
}

ContractCheck runCheck(const CheckEntry& entry, const Initializer& initializer,
                       const ContractOptions& options, bool* out_of_time) {
  if (!options.isolated) return runHere(entry, initializer, options);
  const IsolatedOutcome outcome =
      runIsolated([&] { return packed(runHere(entry, initializer, options)); }, options.limits);
  *out_of_time = outcome.out_of_time;
  return outcome.completed ? unpacked(outcome.output) : contract::failed(outcome.failure);
}

bool isWanted(const CheckEntry& entry, const std::vector<std::string>& only) {
  return only.empty() || std::any_of(only.begin(), only.end(), [&entry](const std::string& w) {
           return matches(entry.description.name, w);
         });
}

constexpr size_t kTimeoutsAllowed = 2;  // then the plugin is taken to hang everywhere

std::string describeStop(const std::vector<std::string>& hung, size_t left) {
  std::string names;
  for (const std::string& name : hung) names += (names.empty() ? "" : " and ") + name;
  return format("stopped: %s ran out of time; %zu checks were not run", names.c_str(), left);
}

/** A method that refuses every motion is no method. */
ContractCheck judgeSomewhere(const std::vector<ContractCheck>& checks) {
  int refused = 0, passed = 0, all = 0;
  for (const ContractCheck& check : checks) {
    if (!startsWith(check.name, kExact)) continue;
    ++all;
    refused += check.verdict == Verdict::kRefused ? 1 : 0;
    passed += check.verdict == Verdict::kPassed ? 1 : 0;
  }
  const std::string text = format("exact on %d of %d motions, %d refused", passed, all, refused);
  ContractCheck check =
      passed > 0 ? contract::passed(text, passed) : contract::failed(text, passed);
  check.name = kSomewhere;
  return check;
}

}  // namespace

const char* toString(ContractCheck::Verdict verdict) {
  switch (verdict) {
    case Verdict::kPassed:
      return "passed";
    case Verdict::kRefused:
      return "refused";
    case Verdict::kFailed:
      return "failed";
    case Verdict::kNotApplicable:
      return "not_applicable";
  }
  return "unknown";
}

int ContractReport::count(ContractCheck::Verdict verdict) const {
  return std::count_if(checks.begin(), checks.end(),
                       [verdict](const ContractCheck& c) { return c.verdict == verdict; });
}

std::vector<ContractCheckDescription> contractChecks() {
  std::vector<ContractCheckDescription> descriptions;
  for (const CheckEntry& entry : allChecks()) descriptions.push_back(entry.description);
  descriptions.push_back(
      {kSomewhere, "Not every motion is refused; judged where all of 'exact.' is run."});
  return descriptions;
}

ContractReport checkContract(const Initializer& initializer, const ContractOptions& options,
                             const std::function<void(const ContractCheck&)>& on_check) {
  const std::vector<CheckEntry> checks = allChecks();
  checkNames(checks, options.only);
  ContractReport report;
  const auto add = [&](const ContractCheck& check) {
    report.checks.push_back(check);
    if (on_check) on_check(check);
  };
  std::vector<const CheckEntry*> wanted;
  for (const CheckEntry& entry : checks)
    if (isWanted(entry, options.only)) wanted.push_back(&entry);
  std::vector<std::string> hung;
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (hung.size() == kTimeoutsAllowed) {
      report.stopped = describeStop(hung, wanted.size() - i);
      return report;
    }
    const std::string& name = wanted[i]->description.name;
    bool out_of_time = false;
    ContractCheck check = runCheck(*wanted[i], initializer, options, &out_of_time);
    check.name = name;
    if (out_of_time) hung.push_back(name);
    if (name == kTime && check.verdict == Verdict::kPassed)
      report.milliseconds_per_call = check.value;
    add(check);
  }
  const bool all_motions =
      options.only.empty() ||
      std::find(options.only.begin(), options.only.end(), kExact) != options.only.end();
  if (all_motions) add(judgeSomewhere(report.checks));
  return report;
}

}  // namespace etalon
