#include <xxhash.h>

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "etalon/benchmark/sequence_tracks.h"
#include "etalon/core/errors.h"
#include "etalon/core/output_file.h"

// The file: 8 bytes magic, uint32 version, 32 characters key, payload, uint64 XXH3 of all before
// it. Payload: int32 unreadable images, double median milliseconds, uint64 frames, and for each
// int64 stamp, uint32 observations, and for each int64 id, double left u v, uint8 has right, then
// double right u v only if it has. Version 2, written where a frame has landmarks that the right
// image alone shows, has these after the others: uint32 number, and for each int64 id, double u v.
// Little-endian, without padding.

namespace etalon {
namespace {

constexpr char kMagic[8] = {'E', 'T', 'A', 'L', 'O', 'N', 'T', 'R'};
constexpr std::uint32_t kStereoVersion = 1, kVersion = 2;
constexpr size_t kKeySize = 32;
constexpr size_t kHeaderSize = sizeof kMagic + sizeof kVersion + kKeySize;

class Writer {
 public:
  template <typename T>
  void put(const T& value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(const char* data, size_t size) { bytes_.append(data, size); }
  std::string& bytes() { return bytes_; }

 private:
  std::string bytes_;
};

/** Reads values; once there are too few bytes, ok() is false and all values are zero. */
class Reader {
 public:
  Reader(const char* data, size_t size) : next_(data), left_(size) {}

  template <typename T>
  T get() {
    T value{};
    if (left_ < sizeof value) {
      ok_ = false;
      left_ = 0;
      return value;
    }
    std::memcpy(&value, next_, sizeof value);
    next_ += sizeof value;
    left_ -= sizeof value;
    return value;
  }
  bool ok() const { return ok_; }
  size_t left() const { return left_; }

 private:
  const char* next_;
  size_t left_;
  bool ok_ = true;
};

void putFrame(const TrackedFrame& frame, std::uint32_t version, Writer* writer) {
  writer->put<std::int64_t>(frame.t);
  writer->put<std::uint32_t>(static_cast<std::uint32_t>(frame.observations.size()));
  for (const Observation& o : frame.observations) {
    writer->put<std::int64_t>(o.id);
    writer->put(o.left.x());
    writer->put(o.left.y());
    writer->put<std::uint8_t>(o.has_right ? 1 : 0);
    if (!o.has_right) continue;
    writer->put(o.right.x());
    writer->put(o.right.y());
  }
  if (version == kStereoVersion) return;
  writer->put<std::uint32_t>(static_cast<std::uint32_t>(frame.right_only.size()));
  for (const RightObservation& o : frame.right_only) {
    writer->put<std::int64_t>(o.id);
    writer->put(o.right.x());
    writer->put(o.right.y());
  }
}

TrackedFrame getFrame(std::uint32_t version, Reader* reader) {
  TrackedFrame frame;
  frame.t = reader->get<std::int64_t>();
  const auto count = reader->get<std::uint32_t>();
  for (std::uint32_t i = 0; i < count && reader->ok(); ++i) {
    Observation o;
    o.id = reader->get<std::int64_t>();
    o.left.x() = reader->get<double>();
    o.left.y() = reader->get<double>();
    o.has_right = reader->get<std::uint8_t>() != 0;
    if (o.has_right) {
      o.right.x() = reader->get<double>();
      o.right.y() = reader->get<double>();
    }
    frame.observations.push_back(o);
  }
  if (version == kStereoVersion) return frame;
  const auto right_count = reader->get<std::uint32_t>();
  for (std::uint32_t i = 0; i < right_count && reader->ok(); ++i) {
    RightObservation o;
    o.id = reader->get<std::int64_t>();
    o.right.x() = reader->get<double>();
    o.right.y() = reader->get<double>();
    frame.right_only.push_back(o);
  }
  return frame;
}

/** The oldest version that can hold these tracks. */
std::uint32_t versionFor(const SequenceTracks& tracks) {
  const bool stereo_alone =
      std::all_of(tracks.frames.begin(), tracks.frames.end(),
                  [](const TrackedFrame& frame) { return frame.right_only.empty(); });
  return stereo_alone ? kStereoVersion : kVersion;
}

std::string readBytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream bytes;
  bytes << file.rdbuf();
  return bytes.str();
}

}  // namespace

bool readTracks(const std::string& path, const std::string& key, SequenceTracks* tracks,
                std::string* why_not) {
  const auto no = [why_not](const char* reason) {
    *why_not = reason;
    return false;
  };
  if (!std::filesystem::exists(path)) return no("there is no such file");
  const std::string bytes = readBytes(path);
  if (bytes.size() < kHeaderSize + sizeof(XXH64_hash_t) ||
      std::memcmp(bytes.data(), kMagic, sizeof kMagic) != 0)
    return no("it is no file of tracks");
  std::uint32_t version = 0;
  std::memcpy(&version, bytes.data() + sizeof kMagic, sizeof version);
  if (version != kStereoVersion && version != kVersion)
    return no("it has another version of the format");
  if (bytes.compare(sizeof kMagic + sizeof kVersion, kKeySize, key) != 0)
    return no("it was made from other data, options or code");
  const size_t size = bytes.size() - sizeof(XXH64_hash_t);
  XXH64_hash_t checksum = 0;
  std::memcpy(&checksum, bytes.data() + size, sizeof checksum);
  if (XXH3_64bits(bytes.data(), size) != checksum) return no("it is damaged: checksum");

  Reader reader(bytes.data() + kHeaderSize, size - kHeaderSize);
  const auto unreadable = reader.get<std::int32_t>();
  const auto frontend_ms = reader.get<double>();
  const auto count = reader.get<std::uint64_t>();
  std::vector<TrackedFrame> frames;
  for (std::uint64_t i = 0; i < count && reader.ok(); ++i)
    frames.push_back(getFrame(version, &reader));
  if (!reader.ok() || reader.left() != 0) return no("it is damaged: length");
  tracks->unreadable_images = unreadable;
  tracks->frontend_ms = frontend_ms;
  tracks->frames = std::move(frames);
  return true;
}

void writeTracks(const std::string& path, const std::string& key, const SequenceTracks& tracks) {
  Writer writer;
  writer.put(kMagic, sizeof kMagic);
  const std::uint32_t version = versionFor(tracks);
  writer.put(version);
  std::string padded = key;
  padded.resize(kKeySize, '0');
  writer.put(padded.data(), kKeySize);
  writer.put<std::int32_t>(tracks.unreadable_images);
  writer.put(tracks.frontend_ms);
  writer.put<std::uint64_t>(tracks.frames.size());
  for (const TrackedFrame& frame : tracks.frames) putFrame(frame, version, &writer);
  writer.put<XXH64_hash_t>(XXH3_64bits(writer.bytes().data(), writer.bytes().size()));

  // Several processes may share the folder: each writes its own file, and the last one stays.
  writeFile(path, writer.bytes());
}

SequenceTracks loadOrTrack(RecordedSource& recording, const std::string& recording_hash,
                           const std::string& name, const std::string& folder,
                           const TrackingOptions& options, std::string* note) {
  namespace fs = std::filesystem;
  const std::string key = tracksKey(recording_hash, options);
  const std::string path =
      (fs::path(folder) / (name + "-" + key.substr(0, 12) + ".tracks")).string();
  SequenceTracks tracks = withoutTracks(recording);
  std::string why_not;
  if (readTracks(path, key, &tracks, &why_not)) return tracks;
  if (note && fs::exists(path)) *note = "cached tracks were made anew: " + path + ": " + why_not;
  tracks = trackSequence(recording, options);
  makeFolder(folder);
  writeTracks(path, key, tracks);
  return tracks;
}

}  // namespace etalon
