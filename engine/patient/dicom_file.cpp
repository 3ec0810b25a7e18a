#include "engine/patient/dicom_file.h"

#include <algorithm>
#include <cmath>
#include <fmt/format.h>

#include "engine/patient/dicom_data.h"

namespace patient {
namespace {

namespace fs = std::filesystem;

constexpr int most_frames = 20'000;

/// What a slice's numbers mean.
Rescale rescale_of(const fs::path& path, DcmDataset& data, const FrameGroups& groups) {
    DcmItem& item = groups.item_with(data, DCM_PixelValueTransformationSequence, DCM_RescaleSlope);
    const Rescale rescale{numbers_of<1>(path, item, DCM_RescaleSlope, "RescaleSlope")[0],
                          numbers_of<1>(path, item, DCM_RescaleIntercept, "RescaleIntercept")[0]};
    if (rescale.slope == 0) refuse_ct(path, "0 was found for RescaleSlope", "expected another number");
    return rescale;
}

/// Numbers that stand for no image: from `low` to `high` as they are stored.
struct Padding {
    double low = 1, high = 0;

    bool holds(double stored) const { return stored >= low && stored <= high; }
};

/// As stored numbers are turned into values.
struct Stored {
    bool is_signed = false;
    int unused = 0;  // bits above the highest, which may hold anything

    double value(std::uint16_t word) const {
        const auto shifted = static_cast<std::uint16_t>(word << unused);
        return is_signed ? static_cast<std::int16_t>(shifted) >> unused : shifted >> unused;
    }
};

/// None where it is air in any case.
Padding padding_of(DcmDataset& data, const Stored& stored, const Rescale& rescale) {
    const auto number = number_of(data, DCM_PixelPaddingValue, 0);
    if (!number || std::abs(*number) > 65535) return {};
    // Signed or not, whatever the samples are.
    const auto value = [&](double given) {
        return stored.value(static_cast<std::uint16_t>(static_cast<int>(given)));
    };
    const double first = value(*number),
                 last = value(std::clamp(number_of(data, DCM_PixelPaddingRangeLimit, 0).value_or(*number),
                                         -65535.0, 65535.0));
    const Padding padding{std::min(first, last), std::max(first, last)};
    constexpr double air = -900;  // [HU] and less
    const auto hu = [&](double at) { return rescale.slope * at + rescale.intercept; };
    if (hu(padding.low) <= air && hu(padding.high) <= air) return {};
    return padding;
}

}  // namespace

bool is_dicom_file(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char bytes[132] = {};
    file.read(bytes, sizeof bytes);
    if (file.gcount() == sizeof bytes && std::string_view(bytes + 128, 4) == "DICM") return true;
    // Groups 2 (meta header) or 8, and an element that is one of their first.
    const auto byte = [&](int at) { return static_cast<unsigned char>(bytes[at]); };
    const bool little = (byte(0) == 8 || byte(0) == 2) && byte(1) == 0 && byte(3) == 0;
    const bool big = byte(0) == 0 && byte(1) == 8 && byte(2) == 0;
    if (file.gcount() < 64 || (!little && !big)) return false;
    const auto is_letter = [&](int at) { return byte(at) >= 'A' && byte(at) <= 'Z'; };
    const bool is_explicit = is_letter(4) && is_letter(5);
    return is_explicit || (little && byte(5) == 0 && byte(6) == 0 && byte(7) == 0);
}

std::vector<DicomSlice> dicom_slices(const fs::path& path) {
    DcmFileFormat file;
    load_dicom(path, file);
    DcmDataset& data = *file.getDataset();
    if (text_of(data, DCM_Modality) != "CT" || !data.tagExists(DCM_PixelData)) return {};
    if (text_of(data, DCM_ImageType).find("LOCALIZER") != std::string::npos) return {};
    // Pictures of the screen, such as dose reports, bear the scanner's modality.
    if (text_of(data, DCM_SOPClassUID).starts_with(UID_SecondaryCaptureImageStorage)) return {};
    DicomSlice slice;
    slice.file = path;
    slice.uid = text_of(data, DCM_SOPInstanceUID);
    slice.series = text_of(data, DCM_SeriesInstanceUID);
    slice.number = text_of(data, DCM_SeriesNumber);
    slice.description = text_of(data, DCM_SeriesDescription);
    slice.frame_of_reference = text_of(data, DCM_FrameOfReferenceUID);
    if (slice.series.empty()) refuse_ct(path, "no SeriesInstanceUID was found", "one is needed");
    slice.rows = whole_of(data, DCM_Rows);
    slice.columns = whole_of(data, DCM_Columns);
    if (slice.rows < 2 || slice.columns < 2)
        refuse_ct(path, fmt::format("{} rows and {} columns were found", slice.rows, slice.columns),
                  "expected 2 or more of each");
    const int bits = whole_of(data, DCM_BitsAllocated), per_pixel = whole_of(data, DCM_SamplesPerPixel);
    if (bits != 16 || per_pixel != 1 || text_of(data, DCM_PhotometricInterpretation) != "MONOCHROME2")
        refuse_ct(path,
                  fmt::format("{} bits in {} values a sample, '{}', were found", bits, per_pixel,
                              text_of(data, DCM_PhotometricInterpretation)),
                  "expected 16 bits in one value, MONOCHROME2");
    const double frames = number_of(data, DCM_NumberOfFrames, 0).value_or(1);
    const std::vector<FrameGroups> groups = groups_of_frames(data);
    const bool enhanced = !groups.empty();
    if (!(frames == std::floor(frames) && frames >= 1 && frames <= most_frames) || (frames > 1 && !enhanced))
        refuse_ct(path,
                  fmt::format("{:g} frames{} were found", frames, enhanced ? "" : " without a place of each"),
                  fmt::format("expected one slice, or an enhanced CT of up to {} frames", most_frames));
    std::vector<DicomSlice> slices;
    for (slice.frame = 0; slice.frame < static_cast<int>(frames); ++slice.frame) {
        const FrameGroups of_frame = static_cast<std::size_t>(slice.frame) < groups.size()
                                         ? groups[static_cast<std::size_t>(slice.frame)]
                                         : FrameGroups{};
        static_cast<DicomPlane&>(slice) = plane_of(path, data, of_frame);
        slice.rescale = rescale_of(path, data, of_frame);
        slices.push_back(slice);
    }
    // Compressed or not, a sample takes some room: no header asks for memory that its file does not fill.
    constexpr double largest_ratio = 1000;
    std::error_code failed;
    const auto size = static_cast<double>(fs::file_size(path, failed));
    if (failed || 2.0 * frames * slice.rows * slice.columns > largest_ratio * size)
        refuse_ct(path,
                  fmt::format("its header asks for {} × {} samples, more than it can hold", slice.columns,
                              slice.rows),
                  "expected a whole DICOM file");
    return slices;
}

void read_dicom_slices(std::span<const DicomSlice* const> slices, std::span<std::int16_t* const> to,
                       SampleFindings& findings) {
    const DicomSlice& first = *slices.front();
    DcmFileFormat file;
    load_dicom(first.file, file);
    DcmDataset& data = *file.getDataset();
    int bits = whole_of(data, DCM_BitsStored);
    if (bits < 1 || bits > 16) bits = 16;
    const Stored stored{whole_of(data, DCM_PixelRepresentation) == 1, 16 - bits};
    StoredSamples samples(first.file, data, first.columns, first.rows);
    for (std::size_t k = 0; k < slices.size(); ++k) {
        const DicomSlice& slice = *slices[k];
        const std::uint16_t* const words = samples.of(slice.frame);
        const Padding padding = padding_of(data, stored, slice.rescale);
        const std::size_t count =
            static_cast<std::size_t>(slice.rows) * static_cast<std::size_t>(slice.columns);
        for (std::size_t i = 0; i < count; ++i) {
            const double value = stored.value(words[i]);
            if (padding.holds(value)) {
                to[k][i] = air_hu;
                ++findings.padding;
                continue;
            }
            const auto hu = findings.sample(slice.rescale.slope * value + slice.rescale.intercept,
                                            SampleKind::Hounsfield);
            if (!hu) refuse_ct(slice.file, "a value that is not finite was found", "expected finite values");
            to[k][i] = *hu;
        }
    }
}

}  // namespace patient
