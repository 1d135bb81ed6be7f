#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

namespace etalon {

/**
 * What speaks against giving the JPEG of an image with colour to MRPT, in words; empty if nothing.
 *
 * MRPT makes room for whatever size a JPEG states, and libjpeg ends the process where it cannot
 * read on.
 *
 * @param width, height  what the log says of the image, pixels
 */
std::string problemOfJpeg(const std::uint8_t* bytes, std::size_t size, std::int64_t width,
                          std::int64_t height);

}  // namespace etalon
