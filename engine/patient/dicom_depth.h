#pragma once
/// Looks at a DICOM file before DCMTK reads it, which calls itself for every sequence within a sequence.

#include <filesystem>
#include <string_view>

namespace patient {

inline constexpr int most_dicom_levels = 64;                               // of sequences within sequences
inline constexpr std::size_t most_inflated_dicom = std::size_t{64} << 20;  // [bytes] of a deflated file

/// Throws InputError for a file in which sequences are nested more than 64 deep, whose sequences are too many
/// to pass unread and cannot be followed, or that a deflated transfer syntax makes larger than
/// `most_inflated`.
void check_dicom_depth(const std::filesystem::path&, std::size_t most_inflated = most_inflated_dicom);

/// The same for the bytes of a file. `name` is for messages.
void check_dicom_depth(std::string_view bytes, const std::filesystem::path& name,
                       std::size_t most_inflated = most_inflated_dicom);

}  // namespace patient
