#include "engine/patient/dicom_depth.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <random>
#include <zlib.h>

#include "engine/patient/ct_image.h"
#include "tests/cases.h"
#include "tests/engine/fixtures.h"

namespace patient {
namespace {

/// Elements byte by byte, as the standard's part 5 orders them.
struct Writer {
    bool is_explicit = true, is_big = false;
    std::string bytes = {};

    void number(std::uint32_t value, int count) {
        for (int k = 0; k < count; ++k)
            bytes += static_cast<char>(value >> 8 * (is_big ? count - 1 - k : k) & 0xFF);
    }
    void tag(std::uint32_t group, std::uint32_t element) {
        number(group, 2);
        number(element, 2);
    }
    void sequence(std::uint32_t length, const char* kind = "SQ") {
        tag(0x0008, 0x1140);
        if (is_explicit) {
            bytes += kind;
            number(0, 2);
        }
        number(length, 4);
    }
    void item(std::uint32_t length) {
        tag(0xFFFE, 0xE000);
        number(length, 4);
    }
    void end(std::uint32_t element) {
        tag(0xFFFE, element);
        number(0, 4);
    }
    void text(std::uint32_t group, std::uint32_t element, const char* kind, std::string value) {
        if (value.size() % 2) value += ' ';
        tag(group, element);
        if (is_explicit) {
            bytes += kind;
            number(static_cast<std::uint32_t>(value.size()), 2);
        } else {
            number(static_cast<std::uint32_t>(value.size()), 4);
        }
        bytes += value;
    }
};

std::string file_of(const std::string& uid, const std::string& elements) {
    Writer meta;
    meta.text(0x0002, 0x0010, "UI", uid);
    Writer file;
    file.bytes = std::string(128, '\0') + "DICM";
    file.tag(0x0002, 0x0000);
    file.bytes += "UL";
    file.number(4, 2);
    file.number(static_cast<std::uint32_t>(meta.bytes.size()), 4);
    return file.bytes + meta.bytes + elements;
}

struct Kind {
    const char* uid;
    bool is_explicit, is_big, deflated;
};
constexpr Kind kinds[] = {{"1.2.840.10008.1.2", false, false, false},
                          {"1.2.840.10008.1.2.1", true, false, false},
                          {"1.2.840.10008.1.2.2", true, true, false},
                          {"1.2.840.10008.1.2.1.99", true, false, true}};

std::string deflated(const std::string& bytes) {
    z_stream stream{};
    deflateInit2(&stream, 9, Z_DEFLATED, -MAX_WBITS, 9, Z_DEFAULT_STRATEGY);
    std::string small(bytes.size() + 1000, '\0');
    stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = reinterpret_cast<Bytef*>(small.data());
    stream.avail_out = static_cast<uInt>(small.size());
    deflate(&stream, Z_FINISH);
    small.resize(stream.total_out);
    deflateEnd(&stream);
    return small;
}

/// `levels` sequences in one another, or `items` in a row, with lengths or with delimiters.
std::string nested(const Kind& kind, int levels, bool with_lengths, bool closed, const char* as = "SQ") {
    Writer inner{kind.is_explicit, kind.is_big, {}};
    inner.text(0x0008, 0x0060, "CS", "CT");
    const Writer blank{kind.is_explicit, kind.is_big, {}};
    if (!closed) {
        Writer open = blank;
        for (int k = 0; k < levels; ++k) open.sequence(0xFFFFFFFF, as), open.item(0xFFFFFFFF);
        inner.bytes = open.bytes + inner.bytes;
    }
    for (int k = 0; closed && k < levels; ++k) {
        Writer outer = blank;
        outer.bytes.reserve(inner.bytes.size() + 64);
        if (with_lengths) {
            outer.sequence(static_cast<std::uint32_t>(inner.bytes.size()) + 8, as);
            outer.item(static_cast<std::uint32_t>(inner.bytes.size()));
            outer.bytes += inner.bytes;
        } else {
            outer.sequence(0xFFFFFFFF, as);
            outer.item(0xFFFFFFFF);
            outer.bytes += inner.bytes;
            outer.end(0xE00D);
            outer.end(0xE0DD);
        }
        inner = std::move(outer);
    }
    return file_of(kind.uid, kind.deflated ? deflated(inner.bytes) : inner.bytes);
}

std::string said(const std::string& bytes) {
    return test::refusal([&] { check_dicom_depth(bytes, "x.dcm"); });
}

}  // namespace

TEST(DicomDepth, SequencesAreNestedSixtyFourDeepAtMostInEverySyntax) {
    for (const Kind& kind : kinds)
        for (const bool with_lengths : {false, true})
            for (const bool closed : {false, true}) {
                const std::string what = fmt::format("{} {} {}", kind.uid, with_lengths, closed);
                for (const int levels : {0, 1, 64})
                    EXPECT_EQ(said(nested(kind, levels, with_lengths, closed)), "") << what;
                for (const int levels : {65, 66, 4000})
                    EXPECT_NE(said(nested(kind, levels, with_lengths, closed)).find("64"), std::string::npos)
                        << what << " " << levels;
            }
    EXPECT_NE(said(nested(kinds[1], 70, false, true, "UN")), "");
}

TEST(DicomDepth, ManyItemsSideBySideAreNoDepth) {
    for (const Kind& kind : kinds) {
        Writer data{kind.is_explicit, kind.is_big, {}};
        for (int k = 0; k < 300; ++k) {
            data.sequence(0xFFFFFFFF);
            for (int i = 0; i < 5; ++i) {
                data.item(0xFFFFFFFF);
                data.text(0x0008, 0x1155, "UI", "1.2.3");
                data.end(0xE00D);
            }
            data.end(0xE0DD);
        }
        EXPECT_EQ(said(file_of(kind.uid, kind.deflated ? deflated(data.bytes) : data.bytes)), "") << kind.uid;
    }
}

/// What no structure explains is refused when it could be deep, and never takes the program down: the same
/// files with bytes changed, cut off or put in go on to DCMTK.
TEST(DicomDepth, DamagedFilesAreReadOrRefused) {
    const unsigned seed = 36003;
    std::mt19937 random(seed);
    const test::TemporaryFolder folder;
    std::filesystem::create_directories(folder / "series");
    for (int round = 0; round < test::cases(1000); ++round) {
        const int levels = 1 << random() % 15;
        // Levels with lengths and their ends take time and bytes of the square of their number.
        const bool with_lengths = random() % 2 && levels <= 4096, closed = random() % 2 && levels <= 4096;
        std::string bytes = nested(kinds[random() % 4], levels, with_lengths, closed);
        for (unsigned k = random() % 4; k > 0; --k)
            bytes[132 + random() % (bytes.size() - 132)] = static_cast<char>(random());
        if (random() % 4 == 0) bytes.resize(132 + random() % (bytes.size() - 132));
        test::write(folder / "series/a.dcm", bytes);
        EXPECT_NE(test::refusal([&] { read_ct(folder / "series"); }), "")
            << "seed " << seed << ", round " << round;
    }
}

TEST(DicomDepth, ADeflatedFileIsAtMostSixtyFourMebibytesInside) {
    Writer data;
    data.tag(0x7FE0, 0x0010);
    data.bytes += "OW";
    data.number(0, 2);
    data.number(100 << 20, 4);
    data.bytes.append(100 << 20, '\0');
    test::expect_said(said(file_of("1.2.840.10008.1.2.1.99", deflated(data.bytes))), "64 MiB");
}

}  // namespace patient
