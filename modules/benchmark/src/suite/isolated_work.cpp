#include "suite/isolated_work.h"

#include <poll.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <list>
#include <memory>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <set>
#include <vector>

#include "etalon/core/errors.h"
#include "etalon/core/process/child_process.h"

namespace etalon {
namespace {

/** What a worker sends: a head, then `size` bytes. */
enum class Message : std::uint64_t { kBegun, kAnswer, kThrew, kItemDone, kDataError, kError };
struct MessageHead {
  Message type = Message::kBegun;
  std::uint64_t part = 0, size = 0;
};

/** What a worker is told to do. */
struct Order {
  std::uint64_t item = 0, first_part = 0;
};

[[noreturn]] void leave() {
  std::fflush(nullptr);
  _exit(0);
}

void sendMessage(int socket, Message type, size_t part, const std::string& text) {
  const MessageHead head{type, part, text.size()};
  if (!writeWhole(socket, &head, sizeof head) || !writeWhole(socket, text.data(), text.size()))
    leave();  // nobody listens
}

void doPart(int socket, size_t part, const std::function<std::string()>& function) {
  sendMessage(socket, Message::kBegun, part, "");
  std::string answer;
  try {
    answer = function();
  } catch (const std::exception& e) {
    return sendMessage(socket, Message::kThrew, part, std::string("threw: ") + e.what());
  } catch (...) {
    return sendMessage(socket, Message::kThrew, part, "threw what is no std::exception");
  }
  sendMessage(socket, Message::kAnswer, part, answer);
}

/** The life of a worker: order after order. */
[[noreturn]] void serve(int socket, const IsolatedWork& work) {
  const DoPart do_part = [socket](size_t part, const std::function<std::string()>& function) {
    doPart(socket, part, function);
  };
  for (;;) {
    Order order;
    const ssize_t n = recv(socket, &order, sizeof order, MSG_WAITALL);
    if (n < 0 && errno == EINTR) continue;
    if (n != sizeof order) leave();
    try {
      work.run(order.item, order.first_part, do_part);
    } catch (const DataError& e) {
      sendMessage(socket, Message::kDataError, 0, e.what());
      leave();
    } catch (const std::exception& e) {
      sendMessage(socket, Message::kError, 0, e.what());
      leave();
    }
    sendMessage(socket, Message::kItemDone, 0, "");
  }
}

/** A worker process, as its parent sees it. The destructor ends it and waits for it. */
class Worker {
 public:
  /** @param others sockets of the other workers, which this one must not hold open */
  Worker(const IsolatedWork& work, double limit_s, const std::vector<int>& others) {
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) fail();
    std::fflush(nullptr);  // or the child would write the parent's text again
    const pid_t parent = getpid();
    process_ = fork();
    if (process_ == 0) {
      close(ends[0]);
      for (const int other : others) close(other);
      prctl(PR_SET_PDEATHSIG, SIGKILL);
      if (getppid() != parent) _exit(1);
      std::signal(SIGINT, SIG_IGN);
      std::signal(SIGTERM, SIG_IGN);
      dup2(STDERR_FILENO, STDOUT_FILENO);
      serve(ends[1], work);
    }
    const int error = errno;
    close(ends[1]);
    socket_ = ends[0];
    if (process_ < 0) {
      close(socket_);
      errno = error;
      fail();
    }
    watch_.emplace(process_, limit_s);
  }
  ~Worker() {
    close(socket_);  // an idle worker then exits
    if (busy() && process_ > 0) kill(process_, SIGKILL);
    wait();
  }
  Worker(const Worker&) = delete;
  Worker& operator=(const Worker&) = delete;

  int socket() const { return socket_; }
  bool busy() const { return item_.has_value(); }
  size_t item() const { return item_.value(); }
  /** The item that it does or did last. */
  const std::optional<size_t>& lastItem() const { return last_item_; }
  /** The part that the worker is doing, if any. */
  const std::optional<size_t>& part() const { return part_; }
  size_t nextPart() const { return next_part_; }
  /** Whether what was read last had the end of a part in it. */
  bool answered() const { return answered_; }
  /** Whether it has begun a part of its item. */
  bool hasBegun() const { return next_part_ > first_part_; }
  bool outOfTime() const { return !why_killed_.empty(); }

  void give(size_t item, size_t first_part) {
    item_ = last_item_ = item;
    part_.reset();
    next_part_ = first_part_ = first_part;
    const Order order{item, first_part};
    writeWhole(socket_, &order, sizeof order);  // read() notices a worker that has died meanwhile
  }

  /** Reads all that has come. Returns false if no more will come. */
  bool read() {
    answered_ = false;
    const bool ended = hasEnded();  // asked first, so that all its messages are there
    std::array<char, 65536> buffer;
    for (;;) {
      const ssize_t n = recv(socket_, buffer.data(), buffer.size(), MSG_DONTWAIT);
      if (n > 0) inbox_.append(buffer.data(), n);
      if (n > 0 || (n < 0 && errno == EINTR)) continue;
      return n < 0 && errno == EAGAIN && !ended;
    }
  }

  /** The next whole message. */
  bool next(MessageHead* head, std::string* text) {
    if (inbox_.size() < sizeof *head) return false;
    std::memcpy(head, inbox_.data(), sizeof *head);
    if (inbox_.size() - sizeof *head < head->size) return false;
    *text = inbox_.substr(sizeof *head, head->size);
    inbox_.erase(0, sizeof *head + head->size);
    part_.reset();
    if (head->type == Message::kBegun) {
      part_ = head->part;
      next_part_ = head->part + 1;
      watch_->restart();
    }
    if (head->type == Message::kItemDone) item_.reset();
    if (head->type == Message::kAnswer || head->type == Message::kThrew) answered_ = true;
    return true;
  }

  double intervalS() const { return watch_->intervalS(); }
  /** Ends a part that uses too much time; read() then notices the end. */
  void look() {
    if (!part_ || !why_killed_.empty()) return;
    why_killed_ = watch_->look();
    if (!why_killed_.empty()) kill(process_, SIGKILL);
  }

  /** Waits for the worker's end and returns how it ended. */
  std::string end() {
    wait();
    return why_killed_.empty() ? describeProcessEnd(status_) : why_killed_;
  }

 private:
  [[noreturn]] static void fail() {
    throw Error(std::string("no worker process can be started: ") + std::strerror(errno));
  }

  /** Whether the process has ended: another process may still hold its socket open. */
  bool hasEnded() {
    if (process_ > 0 && waitpid(process_, &status_, WNOHANG) == process_) process_ = -1;
    return process_ < 0;
  }

  void wait() {
    if (process_ < 0) return;
    while (waitpid(process_, &status_, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
  }

  pid_t process_ = -1;
  int socket_ = -1, status_ = 0;
  std::optional<ProcessWatch> watch_;
  std::optional<size_t> item_, last_item_, part_;
  size_t first_part_ = 0, next_part_ = 0;  ///< of the item
  bool answered_ = false;
  std::string inbox_, why_killed_;
};

class Workers {
 public:
  Workers(int jobs, double limit_s, const IsolatedWork& work)
      : jobs_(std::max(1, jobs)), limit_s_(limit_s), work_(work) {
    for (size_t item = 0; item < work.items; ++item) left_.push_back(item);
  }

  void run() {
    while (workers_.size() < jobs_ && hasNext()) {
      workers_.push_back(hire());
      giveNext(workers_.back().get());
    }
    while (!workers_.empty()) {
      waitForNews();
      noticeStop();
      for (std::unique_ptr<Worker>& worker : workers_)
        if (!attend(worker)) worker.reset();
      workers_.erase(std::remove(workers_.begin(), workers_.end(), nullptr), workers_.end());
    }
  }

 private:
  void noticeStop() {
    if (stopping_ || !work_.stopped()) return;
    stopping_ = true;
    if (work_.stopping) work_.stopping();
  }

  bool hasNext() const { return !left_.empty() && !work_.stopped(); }

  /** The item that costs this worker least, see IsolatedWork::group. */
  std::list<size_t>::iterator bestFor(const Worker& worker) {
    if (!work_.group) return left_.begin();
    std::set<size_t> taken;
    for (const std::unique_ptr<Worker>& other : workers_)
      if (other && other.get() != &worker && other->lastItem())
        taken.insert(work_.group(*other->lastItem()));
    auto best = left_.end();
    for (auto item = left_.begin(); item != left_.end(); ++item) {
      const size_t group = work_.group(*item);
      if (worker.lastItem() && group == work_.group(*worker.lastItem())) return item;
      if (best == left_.end() && taken.count(group) == 0) best = item;
    }
    return best == left_.end() ? left_.begin() : best;
  }

  std::unique_ptr<Worker> hire() const {
    std::vector<int> others;
    for (const std::unique_ptr<Worker>& worker : workers_)
      if (worker) others.push_back(worker->socket());
    return std::make_unique<Worker>(work_, limit_s_, others);
  }

  void waitForNews() {
    std::vector<pollfd> sockets;
    for (const std::unique_ptr<Worker>& worker : workers_)
      sockets.push_back({worker->socket(), POLLIN, 0});
    const double interval_s = workers_.front()->intervalS();
    poll(sockets.data(), sockets.size(), static_cast<int>(1e3 * interval_s));
    const auto now = std::chrono::steady_clock::now();
    if (std::chrono::duration<double>(now - looked_).count() < interval_s) return;
    looked_ = now;
    for (const std::unique_ptr<Worker>& worker : workers_) worker->look();
  }

  /** Handles a worker's messages, and gives it, or its replacement, more to do. Returns false if
   * there is no more. */
  bool attend(std::unique_ptr<Worker>& worker) {
    const bool lives = worker->read();
    hear(worker.get());
    if (!lives) return replace(worker);
    if (worker->busy()) return !(worker->answered() && work_.stopped());
    return giveNext(worker.get());
  }

  bool giveNext(Worker* worker) {
    if (!hasNext()) return false;
    const auto item = bestFor(*worker);
    worker->give(*item, 0);
    left_.erase(item);
    return true;
  }

  void hear(Worker* worker) {
    MessageHead head;
    std::string text;
    while (worker->busy()) {
      const size_t item = worker->item();
      if (!worker->next(&head, &text)) return;
      if (head.type == Message::kAnswer) work_.finished(item, head.part, text);
      if (head.type == Message::kThrew) work_.died(item, head.part, text, false);
      if (head.type == Message::kItemDone) work_.item_done(item);
      if (head.type == Message::kDataError) throw DataError("", 0, text);
      if (head.type == Message::kError) throw Error(text);
    }
  }

  /** Puts a new worker in the place of one that has died. */
  bool replace(std::unique_ptr<Worker>& worker) {
    const std::string how = worker->end();
    if (worker->busy() && work_.stopped()) return false;
    if (!worker->busy()) {
      worker = hire();
      return giveNext(worker.get());
    }
    const size_t item = worker->item(), next_part = worker->nextPart();
    if (worker->part())
      work_.died(item, *worker->part(), how, worker->outOfTime());
    else if (!worker->hasBegun())
      throw Error("a worker process " + how + " before it came to its first task");
    worker = hire();
    if (next_part < work_.parts(item)) {
      worker->give(item, next_part);
      return true;
    }
    work_.item_done(item);
    return giveNext(worker.get());
  }

  const size_t jobs_;
  const double limit_s_;
  const IsolatedWork& work_;
  std::vector<std::unique_ptr<Worker>> workers_;
  bool stopping_ = false;
  std::list<size_t> left_;  ///< items that no worker has taken, in order
  std::chrono::steady_clock::time_point looked_ = std::chrono::steady_clock::now();
};

}  // namespace

void runIsolatedWork(int jobs, double limit_s, const IsolatedWork& work) {
  // A forked process has none of the threads that OpenCV may have here, and would wait for them.
  cv::setNumThreads(1);
  Workers(jobs, limit_s, work).run();
}

}  // namespace etalon
