// Messages between two threads: in order, one frame at most.

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
using Queue = LiveQueue<Message, Frame>;

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
    EXPECT_FALSE(queue.push(message));
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"1", "jump", "2"}));
}

TEST(LiveQueue, ANewerFrameTakesThePlaceOfOneThatWaitsAndGoesToTheEnd) {
  Queue queue;
  queue.push(1);
  EXPECT_FALSE(queue.push(Frame{1}));
  queue.push(2);
  const auto dropped = queue.push(Frame{2});
  ASSERT_TRUE(dropped);
  EXPECT_EQ(dropped->number, 1);
  queue.push(3);
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"1", "2", "frame 2", "3"}));
}

TEST(LiveQueue, AFrameThatWasTakenIsNotDropped) {
  Queue queue;
  queue.push(Frame{1});
  EXPECT_EQ(textOf(*queue.pop()), "frame 1");
  EXPECT_FALSE(queue.push(Frame{2}));
  EXPECT_EQ(drained(&queue), (std::vector<std::string>{"frame 2"}));
}

TEST(LiveQueue, AfterItsEndNothingComesInAndWhatIsThereGoesOut) {
  Queue queue;
  queue.push(Frame{1});
  queue.close();
  EXPECT_FALSE(queue.push(Frame{2}));
  EXPECT_FALSE(queue.push(5));
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
