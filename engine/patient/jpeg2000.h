#pragma once
/// Decodes JPEG 2000 (OpenJPEG), which DCMTK does not.

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace patient {

/// The samples of one image of one component of up to 16 bits, row by row: a code stream, or one in a JP2
/// file. Negative numbers as their 16 bits. Throws InputError, which names `file`, for anything else, another
/// size, and damage.
std::vector<std::uint16_t> decode_jpeg2000(std::span<const std::uint8_t> code, int columns, int rows,
                                           const std::filesystem::path& file);

}  // namespace patient
