#include "engine/patient/ct_samples.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fcntl.h>
#include <fmt/format.h>
#include <limits>
#include <unistd.h>
#include <vector>
#include <zlib.h>

#include "engine/io/error.h"

namespace patient {
namespace {

/// Solves the equations of the header along an axis by elimination (Thomas). The matrix depends on the
/// number of samples alone, and its diagonal outweighs the rest.
class MeansAlongAxis {
public:
    explicit MeansAlongAxis(int count) {
        for (int i = 0; i < count; ++i) {
            const double own = 0.75 + (i == 0 ? beside : 0.0) + (i + 1 == count ? beside : 0.0);
            const double pivot = own - (i == 0 ? 0.0 : beside * after_.back());
            inverse_.push_back(static_cast<float>(1.0 / pivot));
            after_.push_back(static_cast<float>(beside / pivot));
        }
    }

    /// For `lines` neighbouring lines; from a sample to the next it is `stride`.
    void solve(float* values, std::size_t lines, std::size_t stride) const {
        constexpr auto fraction = static_cast<float>(beside);
        for (std::size_t i = 0; i < inverse_.size(); ++i) {
            float* at = values + i * stride;
            for (std::size_t line = 0; line < lines; ++line) {
                const float before = i == 0 ? 0.0f : fraction * (at - stride)[line];
                at[line] = (at[line] - before) * inverse_[i];
            }
        }
        for (std::size_t i = inverse_.size() - 1; i-- > 0;) {
            float* at = values + i * stride;
            for (std::size_t line = 0; line < lines; ++line) at[line] -= after_[i] * (at + stride)[line];
        }
    }

private:
    static constexpr double beside = 0.125;
    std::vector<float> inverse_, after_;
};

std::int16_t rounded(float hu) {
    using Limits = std::numeric_limits<std::int16_t>;
    return static_cast<std::int16_t>(
        std::lrint(std::clamp(hu, static_cast<float>(Limits::min()), static_cast<float>(Limits::max()))));
}

}  // namespace

namespace fs = std::filesystem;

void refuse_ct(const fs::path& path, const std::string& found, const std::string& accepted) {
    throw io::InputError("{}: {}; {}", path.string(), found, accepted);
}

void require_usable(const fs::path& path, const render::VolumeGrid& grid) {
    constexpr int most = 32768;
    double samples = 1;
    for (const int n : grid.size) {
        if (n < 2 || n > most)
            refuse_ct(
                path,
                fmt::format("{} × {} × {} samples were found", grid.size[0], grid.size[1], grid.size[2]),
                fmt::format("expected 2 to {} along each axis", most));
        samples *= n;
    }
    if (samples > most_samples)
        refuse_ct(path, fmt::format("{:.0f} million samples were found", 1e-6 * samples),
                  fmt::format("expected at most {:.0f} million: crop it, or average neighbours",
                              1e-6 * most_samples));
    const geometry::Mat3 axes = grid.axes();
    constexpr double farthest = 1e5;
    if (!axes.allFinite() || !grid.origin.allFinite() || grid.origin.cwiseAbs().maxCoeff() > farthest)
        refuse_ct(path, "its place in space is not finite, or farther than 100 m away",
                  "expected origin and steps in mm");
    double box = 1;
    for (int a = 0; a < 3; ++a) {
        const double step = axes.col(a).norm();
        box *= step;
        if (!(step >= 0.1 && step <= 10))
            refuse_ct(path, fmt::format("samples {:.4g} mm apart along axis {} were found", step, a + 1),
                      "expected 0.1 to 10 mm");
    }
    if (!(std::abs(axes.determinant()) > 0.1 * box))
        refuse_ct(path, "the directions of its axes lie nearly in one plane",
                  "expected axes more or less perpendicular to each other");
}

void require_hounsfield(const fs::path& path, const std::vector<std::int16_t>& hu) {
    const auto [low, high] = std::minmax_element(hu.begin(), hu.end());
    constexpr int fat = -100;
    if (*low > fat)
        refuse_ct(path, fmt::format("values from {} to {} were found", *low, *high),
                  "expected a CT in Hounsfield units, with air at -1000 (labels, MR images and raw values "
                  "without their rescale are not)");
}

struct ByteSource::Gzip {
    gzFile file;
    explicit Gzip(int descriptor) : file(gzdopen(descriptor, "rb")) {
        if (!file) ::close(descriptor);
    }
    ~Gzip() {
        if (file) gzclose(file);
    }
    Gzip(const Gzip&) = delete;
    Gzip& operator=(const Gzip&) = delete;
};

ByteSource::ByteSource(fs::path path, std::uint64_t offset, bool gzip) : path_(std::move(path)) {
    std::error_code failed;
    const std::uint64_t size = fs::is_regular_file(path_, failed) ? fs::file_size(path_, failed) : 0;
    if (failed || size == 0) refuse_ct(path_, "no such file can be read, or it is empty", "expected a CT");
    if (offset > size)
        refuse_ct(path_, fmt::format("the data should begin at byte {}; the file has {}", offset, size),
                  "expected a whole file");
    left_ = size - offset;
    if (gzip) {
        const int descriptor = ::open(path_.c_str(), O_RDONLY | O_CLOEXEC);
        if (descriptor < 0 || ::lseek(descriptor, static_cast<off_t>(offset), SEEK_SET) < 0) {
            if (descriptor >= 0) ::close(descriptor);
            refuse_ct(path_, "no such file can be read", "expected a CT");
        }
        gzip_ = std::make_unique<Gzip>(descriptor);
        if (!gzip_->file) refuse_ct(path_, "there is no memory to decompress it", "expected a CT");
        gzbuffer(gzip_->file, 1 << 18);
    } else {
        plain_.open(path_, std::ios::binary);
        plain_.seekg(static_cast<std::streamoff>(offset));
        if (!plain_) refuse_ct(path_, "no such file can be read", "expected a CT");
    }
}

ByteSource::~ByteSource() = default;

void ByteSource::require(double bytes) const {
    constexpr double deflate_limit = 1032;  // no compressed byte stands for more
    if (bytes > static_cast<double>(left_) * (gzip_ ? deflate_limit : 1.0))
        refuse_ct(path_,
                  fmt::format("its header asks for {:.0f} bytes of samples; {} bytes {}follow", bytes, left_,
                              gzip_ ? "of compressed data " : ""),
                  "expected a whole file");
}

void ByteSource::read(void* to, std::size_t bytes) {
    char* at = static_cast<char*>(to);
    const auto ended = [&] {
        refuse_ct(path_, fmt::format("the data end after {} of {} bytes", taken_, taken_ + bytes),
                  "expected a whole file");
    };
    while (bytes > 0) {
        std::size_t got = 0;
        if (gzip_) {
            const int read =
                gzread(gzip_->file, at, static_cast<unsigned>(std::min<std::size_t>(bytes, 1 << 28)));
            if (read < 0) refuse_ct(path_, "the compressed data are damaged", "expected a whole gzip file");
            got = static_cast<std::size_t>(read);
        } else {
            plain_.read(at, static_cast<std::streamsize>(bytes));
            got = static_cast<std::size_t>(plain_.gcount());
        }
        if (got == 0) ended();
        at += got;
        bytes -= got;
        taken_ += got;
    }
}

void ByteSource::skip(std::uint64_t bytes) {
    std::array<char, 4096> unused;
    for (; bytes > 0; bytes -= std::min<std::uint64_t>(bytes, unused.size()))
        read(unused.data(), static_cast<std::size_t>(std::min<std::uint64_t>(bytes, unused.size())));
}

void ByteSource::finish() {
    char beyond;
    if (gzip_ && gzread(gzip_->file, &beyond, 1) < 0)
        refuse_ct(path_, "the compressed data do not fit their checksum", "expected a whole gzip file");
}

bool is_gzip(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char magic[2] = {};
    return file.read(magic, 2) && magic[0] == '\x1f' && magic[1] == '\x8b';
}

std::vector<std::int16_t> read_samples(ByteSource& source, const fs::path& path, std::size_t count,
                                       io::NumberType type, bool big_endian, Rescale rescale,
                                       const Progress& progress) {
    source.require(static_cast<double>(count) * static_cast<double>(io::size_of(type)));
    std::vector<std::int16_t> hu(count);
    constexpr std::size_t together = 1 << 20;
    std::vector<char> bytes;
    for (std::size_t first = 0; first < count; first += together) {
        if (progress) progress(static_cast<double>(first) / static_cast<double>(count), "reading the CT");
        const std::size_t some = std::min(together, count - first);
        bytes.resize(some * io::size_of(type));
        source.read(bytes.data(), bytes.size());
        const bool finite = io::with_stored_type(type, [&]<class Stored>(Stored) {
            for (std::size_t i = 0; i < some; ++i) {
                const auto number = io::stored_number<Stored>(bytes.data() + i * sizeof(Stored), big_endian);
                const auto sample = as_hu(rescale.slope * static_cast<double>(number) + rescale.intercept);
                if (!sample) return false;
                hu[first + i] = *sample;
            }
            return true;
        });
        if (!finite)
            refuse_ct(path,
                      fmt::format("a value that is not finite was found among samples {} to {}", first,
                                  first + some - 1),
                      "expected finite Hounsfield units");
    }
    source.finish();
    return hu;
}

void interpolate_means(CtImage& ct) {
    const auto nx = static_cast<std::size_t>(ct.grid.size[0]), ny = static_cast<std::size_t>(ct.grid.size[1]),
               nz = static_cast<std::size_t>(ct.grid.size[2]);
    const MeansAlongAxis x(ct.grid.size[0]), y(ct.grid.size[1]), z(ct.grid.size[2]);
    on_all_processors(nz, std::size_t{4}, [&](std::size_t k) {
        std::int16_t* layer = ct.hu.data() + k * nx * ny;
        std::vector<float> values(layer, layer + nx * ny);
        for (std::size_t j = 0; j < ny; ++j) x.solve(values.data() + j * nx, 1, 1);
        y.solve(values.data(), nx, nx);
        std::transform(values.begin(), values.end(), layer, rounded);
    });
    on_all_processors(ny, std::size_t{4}, [&](std::size_t j) {
        std::vector<float> values(nx * nz);
        const auto row = [&](std::size_t k) { return ct.hu.data() + (k * ny + j) * nx; };
        for (std::size_t k = 0; k < nz; ++k) std::copy_n(row(k), nx, values.data() + k * nx);
        z.solve(values.data(), nx, nx);
        for (std::size_t k = 0; k < nz; ++k)
            std::transform(values.data() + k * nx, values.data() + (k + 1) * nx, row(k), rounded);
    });
}

}  // namespace patient
