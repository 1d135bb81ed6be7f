#include "chain_files.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace etalon::testing {

namespace fs = std::filesystem;

CommandResult runEtalon(const std::vector<std::string>& arguments) {
  return runProgram(ETALON_EXECUTABLE, arguments);
}

std::string readText(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  if (!stream) throw std::runtime_error(path + " cannot be read");
  return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
}

nlohmann::json readJson(const std::string& path) { return nlohmann::json::parse(readText(path)); }

std::vector<TumLine> readTum(const std::string& path) {
  std::istringstream text(readText(path));
  std::vector<TumLine> lines;
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream words(line);
    TumLine parsed;
    words >> parsed.stamp;
    for (double& number : parsed.pose) words >> number;
    std::string rest;
    if (!words || words >> rest)
      throw std::runtime_error(path + " holds a line that is not 8 numbers");
    lines.push_back(parsed);
  }
  return lines;
}

double largestDistance(const std::vector<TumLine>& a, const std::vector<TumLine>& b) {
  if (a.size() != b.size()) throw std::runtime_error("trajectories of different length");
  double largest = 0.0;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i].stamp != b[i].stamp)
      throw std::runtime_error("different stamps: " + a[i].stamp + ", " + b[i].stamp);
    const auto &p = a[i].pose, &q = b[i].pose;
    largest = std::max(largest, std::hypot(p[0] - q[0], p[1] - q[1], p[2] - q[2]));
  }
  return largest;
}

std::vector<std::string> stampsOf(const std::string& csv) {
  std::istringstream text(readText(csv));
  std::vector<std::string> stamps;
  for (std::string line; std::getline(text, line);)
    if (!line.empty() && line[0] != '#') stamps.push_back(line.substr(0, line.find(',')));
  return stamps;
}

nlohmann::json acceptedAttempt(const nlohmann::json& run) {
  for (const nlohmann::json& attempt : run.at("attempts"))
    if (attempt.at("status") == "success") return attempt;
  return nullptr;
}

nlohmann::json errorsAfterViBa(const nlohmann::json& attempt) {
  for (const nlohmann::json& stage : attempt.at("stages"))
    if (stage.at("stage") == "vi_ba") return stage.at("errors");
  throw std::runtime_error("no stage vi_ba");
}

RecordingCopy::RecordingCopy(const std::string& original) {
  for (const auto& entry : fs::recursive_directory_iterator(original)) {
    const fs::path to = path() / fs::relative(entry.path(), original);
    if (entry.is_directory())
      fs::create_directories(to);
    else if (entry.path().extension() == ".png")
      fs::create_symlink(fs::absolute(entry.path()), to);
    else
      fs::copy_file(entry.path(), to);
  }
}

std::string RecordingCopy::file(const std::string& name) const { return path() + "/mav0/" + name; }

std::string RecordingCopy::image(int camera, int index) const {
  const std::string folder = file("cam" + std::to_string(camera));
  std::istringstream text(readText(folder + "/data.csv"));
  for (std::string line; std::getline(text, line);) {
    if (line.empty() || line[0] == '#' || index-- > 0) continue;
    const std::string name = line.substr(line.find(',') + 1);
    return folder + "/data/" + name.substr(0, name.find_last_not_of(" \r") + 1);
  }
  throw std::runtime_error(folder + ": fewer images");
}

void RecordingCopy::write(const std::string& path, const std::string& content) const {
  fs::remove(path);  // were it a link, the original would be written
  std::ofstream(path, std::ios::binary) << content;
}

void RecordingCopy::shiftStamps(const std::string& name, long long ns) const {
  std::istringstream text(readText(file(name)));
  std::string shifted;
  for (std::string line; std::getline(text, line);) {
    const size_t comma = line.find(',');
    if (!line.empty() && line[0] != '#')
      line = std::to_string(std::stoll(line.substr(0, comma)) + ns) + line.substr(comma);
    shifted += line + "\n";
  }
  write(file(name), shifted);
}

void RecordingCopy::replace(const std::string& name, const std::string& from,
                            const std::string& to) const {
  std::string text = readText(file(name));
  const size_t at = text.find(from);
  if (at == std::string::npos) throw std::runtime_error(name + ": no '" + from + "' in it");
  write(file(name), text.replace(at, from.size(), to));
}

}  // namespace etalon::testing
