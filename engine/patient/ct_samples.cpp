#include "engine/patient/ct_samples.h"

#include <algorithm>
#include <array>
#include <bzlib.h>
#include <cmath>
#include <fmt/format.h>
#include <limits>
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

/// Turns what a file holds into what was packed; both libraries count alike.
struct ByteSource::Unpacker {
    static constexpr std::size_t together = 1 << 18;
    std::vector<char> packed = std::vector<char>(together);
    double largest_ratio;  // no packed byte stands for more
    bool between = false;  // a stream has ended, and nothing of another one has come

    explicit Unpacker(double ratio) : largest_ratio(ratio) {}
    Unpacker(const Unpacker&) = delete;
    Unpacker& operator=(const Unpacker&) = delete;
    virtual ~Unpacker() = default;
    /// Whether all input has been used.
    virtual bool wants_input() const = 0;
    virtual void give(std::size_t bytes) = 0;
    /// Unpacks up to so many bytes; returns how many, or nothing for damage.
    virtual std::optional<std::size_t> unpack(char* to, std::size_t bytes) = 0;
};

struct ByteSource::Inflater : Unpacker {
    z_stream stream{};
    Inflater() : Unpacker(1032) {
        constexpr int both = 32;  // gzip and zlib
        if (inflateInit2(&stream, MAX_WBITS + both) != Z_OK) throw std::bad_alloc();
    }
    ~Inflater() override { inflateEnd(&stream); }
    bool wants_input() const override { return stream.avail_in == 0; }
    void give(std::size_t bytes) override {
        stream.next_in = reinterpret_cast<Bytef*>(packed.data());
        stream.avail_in = static_cast<uInt>(bytes);
    }
    std::optional<std::size_t> unpack(char* to, std::size_t bytes) override {
        stream.next_out = reinterpret_cast<Bytef*>(to);
        stream.avail_out = static_cast<uInt>(std::min<std::size_t>(bytes, 1 << 28));
        const std::size_t wanted = stream.avail_out;
        const int state = inflate(&stream, Z_NO_FLUSH);
        if (wanted > stream.avail_out) between = false;
        if (state == Z_STREAM_END)
            inflateReset(&stream), between = true;  // another member may follow
        else if (state != Z_OK && state != Z_BUF_ERROR)
            return std::nullopt;
        return wanted - stream.avail_out;
    }
};

struct ByteSource::Bunzipper : Unpacker {
    bz_stream stream{};
    Bunzipper() : Unpacker(1e6) { start(); }
    ~Bunzipper() override { BZ2_bzDecompressEnd(&stream); }
    void start() {
        if (BZ2_bzDecompressInit(&stream, 0, 0) != BZ_OK) throw std::bad_alloc();
    }
    bool wants_input() const override { return stream.avail_in == 0; }
    void give(std::size_t bytes) override {
        stream.next_in = packed.data();
        stream.avail_in = static_cast<unsigned>(bytes);
    }
    std::optional<std::size_t> unpack(char* to, std::size_t bytes) override {
        stream.next_out = to;
        stream.avail_out = static_cast<unsigned>(std::min<std::size_t>(bytes, 1 << 28));
        const std::size_t wanted = stream.avail_out;
        const int state = BZ2_bzDecompress(&stream);
        const std::size_t made = wanted - stream.avail_out;
        if (made > 0) between = false;
        if (state == BZ_STREAM_END) {
            char* const in = stream.next_in;
            const unsigned left = stream.avail_in;
            BZ2_bzDecompressEnd(&stream);
            start();
            stream.next_in = in, stream.avail_in = left;
            between = true;
        } else if (state != BZ_OK) {
            return std::nullopt;
        }
        return made;
    }
};

/// Two digits a byte, and blanks anywhere.
struct ByteSource::HexReader : Unpacker {
    std::size_t at = 0, end = 0;
    int high = -1;  // the first digit of a byte
    HexReader() : Unpacker(0.5) {}
    bool wants_input() const override { return at == end; }
    void give(std::size_t bytes) override { at = 0, end = bytes; }
    std::optional<std::size_t> unpack(char* to, std::size_t bytes) override {
        std::size_t made = 0;
        for (; at < end && made < bytes; ++at) {
            const char c = packed[at];
            if (static_cast<unsigned char>(c) <= ' ') continue;
            const int digit = c >= '0' && c <= '9'   ? c - '0'
                              : c >= 'a' && c <= 'f' ? c - 'a' + 10
                              : c >= 'A' && c <= 'F' ? c - 'A' + 10
                                                     : -1;
            if (digit < 0) return std::nullopt;
            if (high < 0) {
                high = digit;
            } else {
                to[made++] = static_cast<char>(16 * high + digit);
                high = -1;
            }
        }
        return made;
    }
};

ByteSource::ByteSource(fs::path path, std::uint64_t offset, Packing packing) : path_(std::move(path)) {
    std::error_code failed;
    const std::uint64_t size = fs::is_regular_file(path_, failed) ? fs::file_size(path_, failed) : 0;
    if (failed || size == 0) refuse_ct(path_, "no such file can be read, or it is empty", "expected a CT");
    if (offset > size)
        refuse_ct(path_, fmt::format("the data should begin at byte {}; the file has {}", offset, size),
                  "expected a whole file");
    left_ = size - offset;
    plain_.open(path_, std::ios::binary);
    plain_.seekg(static_cast<std::streamoff>(offset));
    if (!plain_) refuse_ct(path_, "no such file can be read", "expected a CT");
    if (packing == Packing::Deflate) unpacker_ = std::make_unique<Inflater>();
    if (packing == Packing::Bzip2) unpacker_ = std::make_unique<Bunzipper>();
    if (packing == Packing::Hex) unpacker_ = std::make_unique<HexReader>();
}

ByteSource::~ByteSource() = default;

void ByteSource::require(double bytes) const {
    if (bytes > static_cast<double>(left_) * (unpacker_ ? unpacker_->largest_ratio : 1.0))
        refuse_ct(path_,
                  fmt::format("its header asks for {:.0f} bytes of samples; {} bytes {}follow", bytes, left_,
                              unpacker_ ? "of compressed data " : ""),
                  "expected a whole file");
}

/// 0 at the end of the data.
std::size_t ByteSource::unpacked(char* to, std::size_t bytes) {
    for (;;) {
        if (unpacker_->wants_input()) {
            plain_.read(unpacker_->packed.data(), static_cast<std::streamsize>(unpacker_->packed.size()));
            unpacker_->give(static_cast<std::size_t>(std::max<std::streamsize>(plain_.gcount(), 0)));
        }
        const bool no_more = unpacker_->wants_input();
        const std::optional<std::size_t> made = unpacker_->unpack(to, bytes);
        if (!made) {
            if (no_more || unpacker_->between) return 0;  // what follows is no part of the data
            refuse_ct(path_, "the compressed data are damaged, or do not fit their checksum",
                      "expected a whole file");
        }
        if (*made > 0 || no_more) return *made;
    }
}

void ByteSource::read(void* to, std::size_t bytes) {
    char* at = static_cast<char*>(to);
    while (bytes > 0) {
        std::size_t got = 0;
        if (unpacker_) {
            got = unpacked(at, bytes);
        } else {
            plain_.read(at, static_cast<std::streamsize>(bytes));
            got = static_cast<std::size_t>(plain_.gcount());
        }
        if (got == 0)
            refuse_ct(path_, fmt::format("the data end after {} of {} bytes", taken_, taken_ + bytes),
                      "expected a whole file");
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
    // Reading on checks the sum behind the last byte.
    char beyond;
    if (unpacker_) unpacked(&beyond, 1);
}

bool is_gzip(const fs::path& path) {
    std::ifstream file(path, std::ios::binary);
    char magic[2] = {};
    return file.read(magic, 2) && magic[0] == '\x1f' && magic[1] == '\x8b';
}

std::vector<std::int16_t> read_samples(ByteSource& source, const fs::path& path, std::size_t count,
                                       io::NumberType type, bool big_endian, Rescale rescale,
                                       const Progress& progress, SampleKind kind, SampleFindings& findings) {
    source.require(static_cast<double>(count) * static_cast<double>(io::size_of(type)));
    std::vector<std::int16_t> samples(count);
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
                const auto sample =
                    findings.sample(rescale.slope * static_cast<double>(number) + rescale.intercept, kind);
                if (!sample) return false;
                samples[first + i] = *sample;
            }
            return true;
        });
        if (!finite)
            refuse_ct(
                path,
                fmt::format("an infinite value was found among samples {} to {}", first, first + some - 1),
                "expected finite ones");
    }
    source.finish();
    return samples;
}

void SampleFindings::tell(CtImage& ct) const {
    const auto tell_of = [&](std::size_t count, const std::string& what) {
        if (count > 0)
            ct.notes.push_back(
                fmt::format("{}: {} ({:.3g} %)", what, count,
                            100.0 * static_cast<double>(count) / static_cast<double>(ct.hu.size())));
    };
    tell_of(not_numbers, "samples that are no numbers were taken as air");
    tell_of(padding, "samples that the file calls padding were taken as air");
    tell_of(above, fmt::format("samples above {} HU, such as metal, were set to it", highest_hu));
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
