#pragma once

#include <chrono>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>
#include <vector>

namespace etalon {

/**
 * Between two threads: messages in order. Where a `Frame` comes before an older one was taken, the
 * older one is late and dropped; the others are few and small, and pass. Frames that come within
 * `burst` of each other are not late: an IMU that delivers its samples in batches lets several
 * frames pass at once.
 */
template <typename Message, typename Frame>
class LiveQueue {
 public:
  using Clock = std::chrono::steady_clock;

  explicit LiveQueue(Clock::duration burst = std::chrono::milliseconds(20)) : burst_(burst) {}

  /** @return the frames that are dropped for this message */
  std::vector<Frame> push(Message message) {
    std::vector<Frame> dropped;
    const Clock::time_point now = Clock::now();
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return dropped;
      if (std::holds_alternative<Frame>(message))
        for (auto it = messages_.begin(); it != messages_.end();) {
          auto* frame = std::get_if<Frame>(&it->message);
          const bool is_late = frame && now - it->came >= burst_;
          if (is_late) dropped.push_back(std::move(*frame));
          it = is_late ? messages_.erase(it) : std::next(it);
        }
      messages_.push_back({std::move(message), now});
    }
    changed_.notify_one();
    return dropped;
  }

  /** Waits for the next message; nothing once the queue is closed and empty. */
  std::optional<Message> pop() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return closed_ || !messages_.empty(); });
    if (messages_.empty()) return std::nullopt;
    Message message = std::move(messages_.front().message);
    messages_.pop_front();
    return message;
  }

  /** What is in it can still be taken, nothing else comes. */
  void close() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      closed_ = true;
    }
    changed_.notify_all();
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  struct Waiting {
    Message message;
    Clock::time_point came;
  };
  std::deque<Waiting> messages_;
  Clock::duration burst_;
  bool closed_ = false;
};

}  // namespace etalon
