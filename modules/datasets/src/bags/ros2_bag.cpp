#include "bags/ros2_bag.h"

#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "bags/cdr_messages.h"
#include "calibration/yaml_map.h"
#include "etalon/core/errors.h"
#include "etalon/core/printable.h"

namespace etalon {

namespace {

namespace fs = std::filesystem;

constexpr const char* kConvert =
    "; expected sqlite3 without compression (`ros2 bag convert` makes such a bag)";

bool startsWith(const std::string& path, const std::string& magic) {
  std::string start(magic.size(), '\0');
  std::ifstream in(path, std::ios::binary);
  return in.read(start.data(), static_cast<std::streamsize>(start.size())) && start == magic;
}

bool isMcap(const std::string& path) { return startsWith(path, "\x89MCAP0\r\n"); }
bool isSqlite(const std::string& path) { return startsWith(path, "SQLite format 3"); }

/** "sensor_msgs/msg/Image" as ROS 1 has it. */
std::string ros1Type(std::string type) {
  const std::string between = "/msg/";
  const size_t at = type.find(between);
  return at == std::string::npos ? type : type.replace(at, between.size(), "/");
}

/** One file, and one statement at a time. */
class Database {
 public:
  explicit Database(const std::string& path) : path_(path) {
    if (sqlite3_open_v2(path.c_str(), &handle_, SQLITE_OPEN_READONLY, nullptr) != SQLITE_OK) fail();
  }
  ~Database() { sqlite3_close(handle_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  /** Calls `act(statement)` for every row. @param parameter of the statement's ?1 */
  template <typename Act>
  void each(const std::string& sql, sqlite3_int64 parameter, Act act) const {
    sqlite3_stmt* prepared = nullptr;
    if (sqlite3_prepare_v2(handle_, sql.c_str(), -1, &prepared, nullptr) != SQLITE_OK) fail();
    const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> statement(prepared,
                                                                          sqlite3_finalize);
    sqlite3_bind_int64(prepared, 1, parameter);
    int result = SQLITE_ROW;
    while ((result = sqlite3_step(prepared)) == SQLITE_ROW) act(prepared);
    if (result != SQLITE_DONE) fail();
  }

  /** The beginning of a message's data, without reading the rest. */
  std::vector<std::uint8_t> beginning(sqlite3_int64 message, int most) const {
    sqlite3_blob* opened = nullptr;
    if (sqlite3_blob_open(handle_, "main", "messages", "data", message, 0, &opened) != SQLITE_OK)
      fail();
    const std::unique_ptr<sqlite3_blob, int (*)(sqlite3_blob*)> blob(opened, sqlite3_blob_close);
    std::vector<std::uint8_t> data(std::min(most, sqlite3_blob_bytes(opened)));
    if (sqlite3_blob_read(opened, data.data(), static_cast<int>(data.size()), 0) != SQLITE_OK)
      fail();
    return data;
  }

  [[noreturn]] void fail() const {
    throw DataError(path_, 0, std::string("expected a ROS 2 bag: ") + sqlite3_errmsg(handle_));
  }

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  sqlite3* handle_ = nullptr;
};

std::string textOf(sqlite3_stmt* row, int column) {
  const unsigned char* const text = sqlite3_column_text(row, column);
  return text ? reinterpret_cast<const char*>(text) : "";
}

const std::uint8_t* blobOf(sqlite3_stmt* row, int column) {
  return static_cast<const std::uint8_t*>(sqlite3_column_blob(row, column));
}

size_t sizeOf(sqlite3_stmt* row, int column) {
  return static_cast<size_t>(sqlite3_column_bytes(row, column));
}

class Ros2Bag : public BagFile {
 public:
  Ros2Bag(const std::string& path, const std::vector<std::string>& files) : path_(path) {
    for (const std::string& file : files) readTopics(file);
  }

  std::vector<BagTopic> topics() const override {
    std::vector<BagTopic> topics;
    for (const auto& [name, topic] : topics_) topics.push_back(topic);
    return topics;
  }

  std::vector<std::string> files() const override {
    std::vector<std::string> files;
    for (const auto& file : files_) files.push_back(file.database->path());
    const std::string metadata = (fs::path(path_) / "metadata.yaml").string();
    if (fs::exists(metadata)) files.push_back(metadata);
    return files;
  }

  std::vector<BagImageEntry> images(const std::string& topic) override {
    std::vector<BagImageEntry> entries;
    constexpr int kHeader = 1024;  // of the stamp and a frame_id
    for (const File& file : files_)
      eachId(file, topic, [&](sqlite3_int64 id) {
        const std::vector<std::uint8_t> data = file.database->beginning(id, kHeader);
        entries.push_back({cdrStamp(data.data(), data.size(), path_), messages_.size()});
        messages_.push_back({&file, id});
      });
    return entries;
  }

  std::vector<ImuSample> imu(const std::string& topic) override {
    return all<ImuSample>(topic, cdrImu);
  }

  std::vector<StampedPose> poses(const std::string& topic) override {
    return all<StampedPose>(topic, cdrPose);
  }

  BagImage image(const std::string& topic, size_t handle) override {
    const Message& message = messages_.at(handle);
    BagImage image;
    message.file->database->each(
        "SELECT data FROM messages WHERE id = ?1", message.id, [&](sqlite3_stmt* row) {
          image = cdrImage(blobOf(row, 0), sizeOf(row, 0),
                           topics_.at(topic).type == kCompressedImageType, path_);
        });
    return image;
  }

 private:
  struct File {
    std::unique_ptr<Database> database;
    std::map<std::string, sqlite3_int64> topic_ids;
  };
  struct Message {
    const File* file = nullptr;
    sqlite3_int64 id = 0;
  };

  void readTopics(const std::string& path) {
    File file;
    file.database = std::make_unique<Database>(path);
    std::map<sqlite3_int64, std::string> names;
    file.database->each(
        "SELECT id, name, type, serialization_format FROM topics", 0, [&](sqlite3_stmt* row) {
          const std::string name = textOf(row, 1), format = textOf(row, 3);
          if (format != "cdr")
            throw DataError(
                path, 0,
                printable("topic " + name + ": expected the serialization 'cdr', found '" + format +
                          "'"));
          names[sqlite3_column_int64(row, 0)] = name;
          file.topic_ids[name] = sqlite3_column_int64(row, 0);
          topics_[name].name = name;
          topics_[name].type = ros1Type(textOf(row, 2));
        });
    file.database->each(
        "SELECT topic_id, count(*) FROM messages GROUP BY topic_id", 0, [&](sqlite3_stmt* row) {
          const auto name = names.find(sqlite3_column_int64(row, 0));
          if (name == names.end()) return;
          topics_[name->second].messages += static_cast<size_t>(sqlite3_column_int64(row, 1));
        });
    files_.push_back(std::move(file));
  }

  template <typename Act>
  void eachId(const File& file, const std::string& topic, Act act) const {
    const auto id = file.topic_ids.find(topic);
    if (id == file.topic_ids.end()) return;
    file.database->each("SELECT id FROM messages WHERE topic_id = ?1 ORDER BY id", id->second,
                        [&](sqlite3_stmt* row) { act(sqlite3_column_int64(row, 0)); });
  }

  template <typename T>
  std::vector<T> all(const std::string& topic,
                     T (*read)(const std::uint8_t*, size_t, const std::string&)) const {
    std::vector<T> result;
    for (const File& file : files_) {
      const auto id = file.topic_ids.find(topic);
      if (id == file.topic_ids.end()) continue;
      file.database->each("SELECT data FROM messages WHERE topic_id = ?1 ORDER BY id", id->second,
                          [&](sqlite3_stmt* row) {
                            result.push_back(read(blobOf(row, 0), sizeOf(row, 0), path_));
                          });
    }
    return result;
  }

  std::string path_;
  std::vector<File> files_;  ///< not changed after the constructor
  std::map<std::string, BagTopic> topics_;
  std::vector<Message> messages_;  ///< of images; the handle is the place in it
};

constexpr char kMetadata[] = "metadata.yaml", kMetadataKey[] = "rosbag2_bagfile_information";

/** Whether its metadata are those of a bag. In a folder of images they may be anything. */
bool isBagFolder(const fs::path& folder) {
  std::error_code error;
  std::ifstream metadata(folder / kMetadata);
  if (!metadata) return false;
  if (!fs::is_directory(folder / "mav0", error) && !fs::is_directory(folder / "cam0", error))
    return true;
  for (std::string line; std::getline(metadata, line);)
    if (line.rfind(kMetadataKey, 0) == 0) return true;
  return false;
}

/** The files of a folder, by its metadata. */
std::vector<std::string> filesOf(const std::string& folder) {
  const YamlMap metadata((fs::path(folder) / kMetadata).string());
  const YamlMap bag = metadata.below(kMetadataKey, "what rosbag2 writes there");
  const std::string storage = bag.word("storage_identifier", "sqlite3");
  if (storage != "sqlite3")
    bag.fail(bag.node("storage_identifier", ""),
             "the storage '" + printable(storage) + "' is not read" + kConvert);
  if (bag.has("compression_format") && bag.node("compression_format", "").IsScalar() &&
      !bag.word("compression_format", "").empty())
    bag.fail(bag.node("compression_format", ""), "the compression '" +
                                                     printable(bag.word("compression_format", "")) +
                                                     "' is not read" + kConvert);
  const std::string expected = "a list of files";
  const YAML::Node list = bag.node("relative_file_paths", expected);
  std::vector<std::string> files;
  if (list.IsSequence())
    for (const YAML::Node& file : list)
      if (file.IsScalar()) files.push_back((fs::path(folder) / file.Scalar()).string());
  if (files.empty()) bag.fail(list, "expected 'relative_file_paths' to be " + expected);
  return files;
}

}  // namespace

bool isRos2Bag(const std::string& path) {
  std::error_code error;
  if (fs::is_directory(path, error)) return isBagFolder(path);
  return isSqlite(path) || isMcap(path);
}

std::unique_ptr<BagFile> openRos2Bag(const std::string& path) {
  if (isMcap(path)) throw DataError(path, 0, std::string("MCAP is not read") + kConvert);
  const std::vector<std::string> files =
      fs::is_directory(path) ? filesOf(path) : std::vector<std::string>{path};
  return std::make_unique<Ros2Bag>(path, files);
}

}  // namespace etalon
