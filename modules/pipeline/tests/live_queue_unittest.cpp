// Messages between two threads: in order, without frames that are late.

#include "etalon/pipeline/live_queue.h"

#include <gtest/gtest.h>

#include <string>
#include <thread>
#include <vector>

namespace etalon {
namespace {

struct Frame {
  int number = 0;
};
using Message = std::variant<int, std::string, Frame>;
/** Without bursts: every frame that waits is late when another one comes. */
struct Queue : LiveQueue<Message, Frame> {
  explicit Queue(Clock::duration burst = Clock::duration::zero()) : LiveQueue(burst) {}
};

/** Numbers and texts as they are, frames as "frame 7". */
std::string textOf(const Message& message) {
  if (const auto* number = std::get_if<int>(&message)) return std::to_string(*number);
  if (const auto* frame = std::get_if<Frame>(&message))
    return "frame " + std::to_string(frame->number);
  return std::get<std::string>(message);
}

std::vector<std::string> drained(Queue* queue) {
  queue->close();
  std::vector<std::string> texts;
  while (const auto message = queue->pop()) texts.push_back(textOf(*message));
  return texts;
}

TEST(LiveQueue, KeepsTheOrderOfWhatIsSmall) {
  Queue queue;
  for (const Message& message : {Message(1), Message("jump"), Message(2)})
    EXPECT_TRUE(queue.push(message).empty());
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"1", "jump", "2"}));
}

TEST(LiveQueue, ANewerFrameTakesThePlaceOfOneThatWaitsAndGoesToTheEnd) {
  Queue queue;
  queue.push(1);
  EXPECT_TRUE(queue.push(Frame{1}).empty());
  queue.push(2);
  const auto dropped = queue.push(Frame{2});
  ASSERT_EQ(dropped.size(), 1U);
  EXPECT_EQ(dropped[0].number, 1);
  queue.push(3);
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"1", "2", "frame 2", "3"}));
}

TEST(LiveQueue, FramesThatComeTogetherWaitTogether) {
  Queue queue(std::chrono::hours(1));
  for (int i = 1; i <= 3; ++i) EXPECT_TRUE(queue.push(Frame{i}).empty());
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"frame 1", "frame 2", "frame 3"}));
}

TEST(LiveQueue, AllThatAreLateAreDropped) {
  Queue queue(std::chrono::milliseconds(1));
  queue.push(Frame{1});
  queue.push(Frame{2});
  std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_GE(queue.push(Frame{3}).size(), 1U);
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"frame 3"}));
}

TEST(LiveQueue, AFrameThatWasTakenIsNotDropped) {
  Queue queue;
  queue.push(Frame{1});
  EXPECT_EQ(textOf(*queue.pop()), "frame 1");
  EXPECT_TRUE(queue.push(Frame{2}).empty());
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"frame 2"}));
}

TEST(LiveQueue, AfterItsEndNothingComesInAndWhatIsThereGoesOut) {
  Queue queue;
  queue.push(Frame{1});
  queue.close();
  EXPECT_TRUE(queue.push(Frame{2}).empty());
  EXPECT_TRUE(queue.push(5).empty());
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"frame 1"}));
  EXPECT_FALSE(queue.pop());
}

TEST(LiveQueue, WhoWaitsIsWokenByAMessageAndByTheEnd) {
  Queue queue;
  std::vector<std::string> taken;
  std::thread reader([&] {
    while (const auto message = queue.pop()) taken.push_back(textOf(*message));
  });
  for (int i = 0; i < 1000; ++i) queue.push(i);
  queue.close();
  reader.join();
  ASSERT_EQ(taken.size(), 1000U);
  for (size_t i = 0; i < 1000; ++i) EXPECT_EQ(taken[i], std::to_string(i));
}

}  // namespace
}  // namespace etalon
