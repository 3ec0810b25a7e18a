#pragma once
/// What the readers of CT files share: bytes from plain and compressed files, numbers of any type, checks.

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "engine/io/number_type.h"
#include "engine/patient/ct_image.h"
#include "physics/geometry/parallel.h"

namespace patient {

/// The readers by kind of file. The same errors as read_ct.
CtImage read_nifti(const std::filesystem::path&, const Progress&);
CtImage read_nrrd(const std::filesystem::path&, const Progress&);
LabelImage read_nifti_labels(const std::filesystem::path&, const Progress&);
LabelImage read_nrrd_labels(const std::filesystem::path&, const Progress&);
LabelImage read_dicom_labels(const std::filesystem::path&, const Progress&);
CtImage read_dicom(const std::filesystem::path& folder, const std::string& series, const Progress&);

CtImage read_metaimage(const std::filesystem::path&, const Progress&);
LabelImage read_metaimage_labels(const std::filesystem::path&, const Progress&);

/// The files with the samples of a header; none where they are in the file itself. Throw InputError.
std::vector<std::filesystem::path> nrrd_data_files(const std::filesystem::path&);
std::vector<std::filesystem::path> metaimage_data_files(const std::filesystem::path&);
std::vector<std::filesystem::path> nifti_data_files(const std::filesystem::path&);

/// Calls work(i) for every i < count, blocks of neighbouring ones on any processor.
template <class Index, class Work>
void on_all_processors(Index count, Index block, const Work& work) {
    const auto threads = std::clamp(std::thread::hardware_concurrency(), 1u, 64u);
    geometry::parallel_for(count, static_cast<int>(threads), work, {}, block);
}

/// All regular files in a folder and those within it, in order; folders behind links are left out, and links
/// to nothing, which are listed on request. Throws InputError, which names what cannot be read, and for more
/// than 20 000, before any is opened.
std::vector<std::filesystem::path> files_below(
    const std::filesystem::path& folder, std::vector<std::filesystem::path>* links_to_nothing = nullptr);

/// "PATH: FOUND; ACCEPTED" as an InputError.
[[noreturn]] void refuse_ct(const std::filesystem::path&, const std::string& found,
                            const std::string& accepted);

/// Throws InputError unless there are 2 to 32768 samples along each axis, few enough for memory, in steps of
/// 0.1 to 10 mm that are finite and not in one plane.
void require_usable(const std::filesystem::path&, const render::VolumeGrid&);
/// Throws InputError when no value is below −100: a CT shows fat and air.
void require_hounsfield(const std::filesystem::path&, const std::vector<std::int16_t>& hu);

/// How the bytes of a file are packed: gzip and zlib are told apart by their first bytes; two digits a byte.
enum class Packing { None, Deflate, Bzip2, Hex };

/// A file read from front to back, unpacked on the way.
class ByteSource {
public:
    /// From `offset` on [bytes]. Throws InputError when the file cannot be read.
    ByteSource(std::filesystem::path, std::uint64_t offset, Packing);
    ~ByteSource();
    ByteSource(const ByteSource&) = delete;
    ByteSource& operator=(const ByteSource&) = delete;

    /// Throws InputError when so many bytes cannot follow, before memory is taken for them.
    void require(double bytes) const;
    /// Throws InputError when the file ends before, or is damaged.
    void read(void* to, std::size_t bytes);
    void skip(std::uint64_t bytes);
    /// Throws InputError when the checksum behind the last byte of compressed data does not fit.
    void finish();

private:
    struct Unpacker;
    struct Inflater;
    struct Bunzipper;
    struct HexReader;
    std::size_t unpacked(char* to, std::size_t bytes);

    std::filesystem::path path_;
    std::uint64_t left_ = 0;  // of the file, as it is stored [bytes]
    std::uint64_t taken_ = 0;
    std::ifstream plain_;
    std::unique_ptr<Unpacker> unpacker_;  // none: the bytes are the file's
};

/// True when the file begins as gzip does.
bool is_gzip(const std::filesystem::path&);

/// How stored numbers become Hounsfield units.
struct Rescale {
    double slope = 1.0, intercept = 0.0;
};

/// Hounsfield units are set to the nearer of scanners' limits, and what is not a number is air; labels to
/// those of 16 bits, and what is not a number is 0.
enum class SampleKind { Hounsfield, Labels };

/// Clamped and rounded; empty when it is not finite.
inline std::optional<std::int16_t> as_hu(double value) {
    if (!(value > -1e300 && value < 1e300)) return std::nullopt;
    const double within = value < lowest_hu ? lowest_hu : value > highest_hu ? highest_hu : value;
    return static_cast<std::int16_t>(within < 0 ? within - 0.5 : within + 0.5);
}

inline constexpr std::int16_t air_hu = -1000;

/// Turns numbers into samples, and keeps in mind what there was among them.
struct SampleFindings {
    bool fractions = false;       // labels that were not whole
    std::size_t not_numbers = 0;  // NaN
    std::size_t above = 0;        // beyond highest_hu
    std::size_t padding = 0;      // no image, by what the file says

    /// Empty for a number that is too large for a double.
    std::optional<std::int16_t> sample(double value, SampleKind kind) {
        if (value != value) {
            ++not_numbers;
            return kind == SampleKind::Labels ? std::int16_t{0} : air_hu;
        }
        if (kind == SampleKind::Hounsfield) {
            above += value > highest_hu;
            return as_hu(value);
        }
        if (!(value > -1e300 && value < 1e300)) return std::nullopt;
        fractions = fractions || value != std::floor(value);
        const double within = value < -32768 ? -32768 : value > 32767 ? 32767 : value;
        return static_cast<std::int16_t>(within < 0 ? within - 0.5 : within + 0.5);
    }
    /// Adds a note of each kind that there was, but of fractions.
    void tell(CtImage&) const;
};

/// The next `count` numbers of the source. Throws InputError when they end before, or one is infinite.
std::vector<std::int16_t> read_samples(ByteSource&, const std::filesystem::path&, std::size_t count,
                                       io::NumberType, bool big_endian, Rescale, const Progress&, SampleKind,
                                       SampleFindings&);

/// A scanner's number is a mean over a voxel. Straight lines between such numbers would blur a second time,
/// over two more voxels. This replaces them with those samples whose linear interpolation has the given
/// numbers as its means: along each axis (s[i−1] + 6 s[i] + s[i+1])/8 = mean[i], with s constant beyond the
/// ends. Sums along rays are kept; at an edge samples go up to a fifth of the step beyond it on each axis.
void interpolate_means(CtImage&);

}  // namespace patient
