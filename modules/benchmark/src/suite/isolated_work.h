#pragma once

#include <cstddef>
#include <functional>
#include <string>

namespace etalon {

/** Does one part in a worker process: calls the function and sends what it returns. */
using DoPart = std::function<void(std::size_t part, const std::function<std::string()>& function)>;

/**
 * Work that may end its process. It is cut into items, and an item into parts that are done one
 * after the other.
 */
struct IsolatedWork {
  std::size_t items = 0;
  std::function<std::size_t(std::size_t item)> parts;  ///< how many an item has
  /** Items of a group share what a worker keeps in memory: it goes on with the group that it is at,
   * then with one that no other worker is at. Empty: the items are done in their order. */
  std::function<std::size_t(std::size_t item)> group;

  /** In a worker process: calls do_part for the parts of an item from `first` on, in order. An
   * exception outside of do_part ends the whole work. */
  std::function<void(std::size_t item, std::size_t first, const DoPart& do_part)> run;

  // In this process, one at a time:
  std::function<void(std::size_t item, std::size_t part, const std::string& answer)> finished;
  /** @param how the worker's end, or what the part threw, as the end of a sentence ("crashed with
   * signal 11 (Segmentation fault)"). @param out_of_time the part was ended by the limit */
  std::function<void(std::size_t item, std::size_t part, const std::string& how, bool out_of_time)>
      died;
  std::function<void(std::size_t item)> item_done;
  std::function<bool()> stopped;  ///< whether no further part shall begin
  /** Called once, when stopped() is seen to be true while parts are in progress; may be empty. */
  std::function<void()> stopping;
};

/**
 * Does the work in `jobs` child processes, which see this process as it is now (a fork) and take
 * item after item. A worker that dies loses its current part, and a new worker does the next one. A
 * part that uses more processor time than `limit_s`, or waits that long, is ended.
 *
 * To be called while this process has one thread. Workers write to standard error what they would
 * write to standard output, and do not hear SIGINT and SIGTERM: once stopped() is true the parts in
 * progress are finished, and the rest of their items is left. A worker that dies after that leaves
 * its part undone.
 *
 * @throws DataError, Error as run() did in a worker; Error if no process can be started, or one
 *         dies between two parts
 */
void runIsolatedWork(int jobs, double limit_s, const IsolatedWork& work);

}  // namespace etalon
