#pragma once

#include <cstddef>
#include <cstdint>

/** What is fuzzed: each takes one input, any bytes, and must neither crash, hang nor leak. */
namespace etalon::fuzz {

void bag(const std::uint8_t* data, std::size_t size);
void camchain(const std::uint8_t* data, std::size_t size);
void euroc(const std::uint8_t* data, std::size_t size);
void faults(const std::uint8_t* data, std::size_t size);
void ini(const std::uint8_t* data, std::size_t size);
void json(const std::uint8_t* data, std::size_t size);
void pipeline(const std::uint8_t* data, std::size_t size);
void plugin(const std::uint8_t* data, std::size_t size);
void rawlog(const std::uint8_t* data, std::size_t size);
void tum(const std::uint8_t* data, std::size_t size);

}  // namespace etalon::fuzz
