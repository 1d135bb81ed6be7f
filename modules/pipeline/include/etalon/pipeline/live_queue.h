#pragma once

#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <variant>

namespace etalon {

/**
 * Between two threads: messages in order, of which at most one is a `Frame`. Where another one
 * comes before it was taken, the older one is dropped; the others are few and small, and pass.
 */
template <typename Message, typename Frame>
class LiveQueue {
 public:
  /** @return the frame that is dropped for this message */
  std::optional<Frame> push(Message message) {
    std::optional<Frame> dropped;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (closed_) return dropped;
      if (std::holds_alternative<Frame>(message))
        for (auto it = messages_.begin(); it != messages_.end(); ++it)
          if (auto* frame = std::get_if<Frame>(&*it)) {
            dropped = std::move(*frame);
            messages_.erase(it);
            break;
          }
      messages_.push_back(std::move(message));
    }
    changed_.notify_one();
    return dropped;
  }

  /** Waits for the next message; nothing once the queue is closed and empty. */
  std::optional<Message> pop() {
    std::unique_lock<std::mutex> lock(mutex_);
    changed_.wait(lock, [this] { return closed_ || !messages_.empty(); });
    if (messages_.empty()) return std::nullopt;
    Message message = std::move(messages_.front());
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
  std::deque<Message> messages_;
  bool closed_ = false;
};

}  // namespace etalon
