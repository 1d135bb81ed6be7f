#include "bags/ros1_structure.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <map>
#include <vector>

#include "etalon/core/errors.h"

namespace etalon {

namespace {

enum Operation : std::uint8_t { kMessage = 2, kBagHeader, kIndex, kChunk, kChunkInfo, kConnection };

struct Record {
  std::uint64_t begin = 0, data = 0, end = 0;  ///< offsets in the file
  std::map<std::string, std::string> fields;
  std::uint8_t operation = 0;

  std::uint64_t size() const { return end - begin; }
};

class Walk {
 public:
  explicit Walk(const std::string& path) : path_(path), in_(path, std::ios::binary) {
    in_.seekg(0, std::ios::end);
    file_end_ = static_cast<std::uint64_t>(std::max<std::streamoff>(0, in_.tellg()));
  }

  void run() {
    constexpr std::uint64_t kMagic = 13;  // "#ROSBAG V2.0\n"
    for (std::uint64_t at = kMagic; at < file_end_;) {
      const Record record = readRecord(at, file_end_);
      at = record.end;
      if (record.operation == kChunk) startChunk(record);
      if (record.operation == kIndex) checkIndex(record);
      if (record.operation == kChunkInfo)
        infos_.push_back(field<std::uint64_t>(record, "chunk_pos"));
      if (record.operation == kBagHeader && field<std::uint64_t>(record, "index_pos") > file_end_)
        fail(record.begin, "the index lies behind the end of the file");
    }
    for (const std::uint64_t position : infos_)
      if (!std::binary_search(chunks_.begin(), chunks_.end(), position))
        fail(position, "the index names a chunk that is not there");
  }

 private:
  [[noreturn]] void fail(std::uint64_t at, const std::string& message) const {
    throw DataError(path_, 0,
                    "expected a ROS 1 bag: " + message + " (offset " + std::to_string(at) + ")");
  }

  template <typename T>
  T number(std::uint64_t at, std::uint64_t end) {
    T value{};
    if (at + sizeof value > end) fail(at, "a record ends too soon");
    in_.seekg(static_cast<std::streamoff>(at));
    if (!in_.read(reinterpret_cast<char*>(&value), sizeof value)) fail(at, "it cannot be read");
    return value;
  }

  template <typename T>
  T field(const Record& record, const std::string& name) const {
    const auto found = record.fields.find(name);
    if (found == record.fields.end() || found->second.size() != sizeof(T))
      fail(record.begin, "a record without '" + name + "'");
    T value{};
    std::memcpy(&value, found->second.data(), sizeof value);
    return value;
  }

  /** The record at `at`, which must end before `end`. */
  Record readRecord(std::uint64_t at, std::uint64_t end) {
    Record record;
    record.begin = at;
    const std::uint64_t header = number<std::uint32_t>(at, end);
    const std::uint64_t header_end = at + 4 + header;
    record.data = header_end + 4;
    record.end = record.data + number<std::uint32_t>(header_end, end);
    if (record.end > end) fail(at, "a record ends too soon");
    for (std::uint64_t k = at + 4; k < header_end;) {
      const std::uint64_t length = number<std::uint32_t>(k, header_end);
      if (k + 4 + length > header_end) fail(k, "a field of a record's header ends too soon");
      std::string text(length, '\0');
      in_.read(text.data(), static_cast<std::streamsize>(length));
      const size_t equals = text.find('=');
      if (!in_ || equals == std::string::npos) fail(k, "a field of a record's header is no field");
      record.fields[text.substr(0, equals)] = text.substr(equals + 1);
      k += 4 + length;
    }
    record.operation = field<std::uint8_t>(record, "op");
    return record;
  }

  void startChunk(const Record& chunk) {
    chunks_.push_back(chunk.begin);
    chunk_size_ = field<std::uint32_t>(chunk, "size");
    messages_.clear();
    const auto compression = chunk.fields.find("compression");
    plain_ = compression != chunk.fields.end() && compression->second == "none";
    if (!plain_) return;
    if (chunk.data + chunk_size_ != chunk.end) fail(chunk.begin, "a chunk of another size");
    for (std::uint64_t at = chunk.data; at < chunk.end;) {
      const Record record = readRecord(at, chunk.end);
      if (record.operation == kMessage) messages_.push_back(at - chunk.data);
      at = record.end;
    }
  }

  /** The index of the chunk before it, of one connection: time and offset of every message. */
  void checkIndex(const Record& index) {
    constexpr std::uint64_t kEntry = 12, kOffset = 8;
    const std::uint64_t count = field<std::uint32_t>(index, "count");
    if (index.data + kEntry * count != index.end) fail(index.begin, "an index of another size");
    for (std::uint64_t k = 0; k < count; ++k) {
      const std::uint64_t at = index.data + kEntry * k + kOffset;
      const std::uint64_t offset = number<std::uint32_t>(at, index.end);
      const bool there = plain_ ? std::binary_search(messages_.begin(), messages_.end(), offset)
                                : offset + kEntry < chunk_size_;
      if (!there) fail(at, "the index names a message that is not there");
    }
  }

  std::string path_;
  std::ifstream in_;
  std::uint64_t file_end_ = 0;
  std::vector<std::uint64_t> chunks_, infos_;  ///< offsets in the file
  // Of the last chunk:
  std::uint64_t chunk_size_ = 0;
  bool plain_ = false;                   ///< not compressed
  std::vector<std::uint64_t> messages_;  ///< offsets in it
};

}  // namespace

void checkRos1Structure(const std::string& path) { Walk(path).run(); }

}  // namespace etalon
