#pragma once
/// What the readers of DICOM files share: DCMTK, values of elements, places of frames, samples.

#include <array>
#include <cstdint>
#include <dcmtk/dcmdata/dctk.h>
#include <filesystem>
#include <fmt/format.h>
#include <optional>
#include <string>
#include <vector>

#include "engine/patient/dicom_depth.h"
#include "engine/patient/dicom_file.h"

namespace patient {

/// Loads a file; values longer than a few thousand bytes stay in it until they are asked for. Throws
/// InputError.
void load_dicom(const std::filesystem::path&, DcmFileFormat&,
                std::size_t most_inflated = most_inflated_dicom);

/// Values of an element as they are written, 120 characters at most; empty without one.
std::string text_of(DcmItem&, const DcmTagKey&);
std::optional<double> number_of(DcmItem&, const DcmTagKey&, unsigned long index);
/// -1 without one.
int whole_of(DcmItem&, const DcmTagKey&);

template <std::size_t N>
std::array<double, N> numbers_of(const std::filesystem::path& path, DcmItem& data, const DcmTagKey& tag,
                                 const char* name) {
    std::array<double, N> result;
    for (std::size_t i = 0; i < N; ++i) {
        const auto number = number_of(data, tag, i);
        if (!number)
            refuse_ct(path, fmt::format("'{}' was found for {}", text_of(data, tag), name),
                      N == 1 ? "expected a finite number" : fmt::format("expected {} finite numbers", N));
        result[i] = *number;
    }
    return result;
}

/// Items in which the parameters of a frame lie: its own, then those of all.
struct FrameGroups {
    DcmItem* own = nullptr;
    DcmItem* shared = nullptr;

    /// The item of a group that has the tag. Without one the data set's own, as in a file of one slice.
    DcmItem& item_with(DcmDataset& data, const DcmTagKey& group, const DcmTagKey& tag) const;
};
/// Of each frame, in their order; none in a file without such groups.
std::vector<FrameGroups> groups_of_frames(DcmDataset&);

/// Throws InputError.
DicomPlane plane_of(const std::filesystem::path&, DcmDataset&, const FrameGroups&);

/// Samples of one file's frames as they are stored, of 8 or 16 bits each.
class StoredSamples {
public:
    /// Throws InputError where DCMTK or OpenJPEG cannot decode them.
    StoredSamples(const std::filesystem::path&, DcmDataset&, int columns, int rows);
    /// Valid until the next call. Throws InputError.
    const std::uint16_t* of(int frame);

private:
    const std::filesystem::path path_;
    std::size_t samples_, found_ = 0;
    int columns_, rows_, frames_;
    const Uint16* words_ = nullptr;
    const Uint8* bytes_ = nullptr;
    DcmPixelSequence* fragments_ = nullptr;
    std::vector<std::uint16_t> decoded_;
};

}  // namespace patient
