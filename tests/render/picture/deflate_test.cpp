#include "render/picture/deflate.h"

#include <gtest/gtest.h>
#include <random>
#include <utility>
#include <zlib.h>

#include "tests/render/images.h"

namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes deflated(const Bytes& bytes) {
    Bytes stream;
    render::deflate_noise(bytes, stream);
    return stream;
}

/// Inflated by zlib, which checks the sum at the end too; nothing where it reports an error.
Bytes inflated(const Bytes& stream, std::size_t size) {
    Bytes bytes(size + 1);
    uLongf length = bytes.size();
    if (uncompress(bytes.data(), &length, stream.data(), stream.size()) != Z_OK) return {};
    bytes.resize(length);
    return bytes;
}

/// Zlib's own stream of the same bytes without a search for repeats.
std::size_t size_by_zlib(Bytes bytes) {
    z_stream stream{};
    deflateInit2(&stream, 1, Z_DEFLATED, 15, 8, Z_HUFFMAN_ONLY);
    Bytes to(deflateBound(&stream, bytes.size()));
    stream.next_in = bytes.data();
    stream.avail_in = static_cast<uInt>(bytes.size());
    stream.next_out = to.data();
    stream.avail_out = static_cast<uInt>(to.size());
    deflate(&stream, Z_FINISH);
    deflateEnd(&stream);
    return stream.total_out;
}

/// Differences of neighbours in a noisy image: few bits each.
Bytes noise(std::size_t size, double spread) {
    std::mt19937 random(1);
    Bytes bytes(size);
    for (std::uint8_t& byte : bytes) {
        double sum = -6;
        for (int k = 0; k < 12; ++k) sum += static_cast<double>(random()) / 4294967296.0;
        byte = static_cast<std::uint8_t>(static_cast<int>(spread * sum + 1000) - 1000);
    }
    return bytes;
}

/// Runs of random lengths up to a longest one.
Bytes runs(std::size_t size, int longest) {
    std::mt19937 random(2);
    Bytes bytes;
    while (bytes.size() < size)
        bytes.insert(bytes.end(), 1 + random() % longest, static_cast<std::uint8_t>(random()));
    bytes.resize(size);
    return bytes;
}

TEST(Deflate, NoiseComesBackFromZlibWhateverItsLength) {
    const Bytes bytes = noise(200000, 9);
    for (const std::size_t size : {1, 2, 3, 4, 7, 8, 9, 100, 65535, 65536, 65537, 131072, 200000}) {
        const Bytes some(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
        EXPECT_EQ(inflated(deflated(some), size), some) << size;
    }
    EXPECT_EQ(inflated(deflated({}), 0), Bytes{});
    EXPECT_FALSE(deflated({}).empty());
}

TEST(Deflate, RunsOfEveryLengthComeBack) {
    for (std::size_t size = 1; size < 600; ++size) {
        const Bytes plain(size, 7);
        EXPECT_EQ(inflated(deflated(plain), size), plain) << size;
    }
    for (const int longest : {2, 9, 20, 300, 2000}) {
        const Bytes bytes = runs(150000, longest);
        EXPECT_EQ(inflated(deflated(bytes), bytes.size()), bytes) << longest;
    }
}

TEST(Deflate, AnyBytesComeBack) {
    const Bytes bytes = test::noisy(300, 300).pixels;
    EXPECT_EQ(inflated(deflated(bytes), bytes.size()), bytes);
    EXPECT_LT(deflated(bytes).size(), bytes.size() + bytes.size() / 100)
        << "what cannot be packed hardly grows";
}

TEST(Deflate, NoCodeIsLongerThanTheFormatAllows) {
    // Counts that grow as Fibonacci's numbers make Huffman's longest codes: 21 bits here, where 15 are
    // allowed.
    Bytes bytes;
    std::size_t count = 1, next = 1;
    for (int k = 0; k < 22; ++k) {
        bytes.insert(bytes.end(), count, static_cast<std::uint8_t>(3 * k));
        count = std::exchange(next, count + next);
    }
    std::mt19937 random(3);
    for (std::size_t i = bytes.size(); i > 1; --i) std::swap(bytes[i - 1], bytes[random() % i]);
    ASSERT_LT(bytes.size(), 65536u) << "of one block";
    EXPECT_EQ(inflated(deflated(bytes), bytes.size()), bytes);
}

TEST(Deflate, PacksNoiseAsWellAsZlibAndFlatPiecesBetter) {
    const Bytes grainy = noise(260000, 9);
    EXPECT_LT(static_cast<double>(deflated(grainy).size()),
              1.005 * static_cast<double>(size_by_zlib(grainy)));
    EXPECT_LT(deflated(Bytes(260000, 0)).size(), 2000u);
}

TEST(Deflate, EqualBytesGiveEqualStreamsBehindWhatWasThere) {
    const Bytes bytes = noise(1000, 3);
    EXPECT_EQ(deflated(bytes), deflated(bytes));
    Bytes stream = {1, 2, 3};
    render::deflate_noise(bytes, stream);
    EXPECT_EQ(Bytes(stream.begin(), stream.begin() + 3), (Bytes{1, 2, 3}));
    EXPECT_EQ(Bytes(stream.begin() + 3, stream.end()), deflated(bytes));
}

TEST(Deflate, OfGreyAndColouredPixelsIsReadBack) {
    // Grey and coloured pixels, flat parts, and any remainder.
    for (const std::size_t size : {0u, 1u, 2u, 3u, 5u, 64u, 65535u, 65538u, 200001u}) {
        Bytes bytes;
        std::mt19937 random(3);
        const Bytes grey = noise(size, 9);
        for (std::size_t i = 0; bytes.size() < size; ++i) {
            const bool flat = i / 5000 % 3 == 2, coloured = random() % 9 == 0;
            for (int k = 0; k < 3; ++k)
                bytes.push_back(flat ? 7 : coloured ? static_cast<std::uint8_t>(random()) : grey[i]);
        }
        bytes.resize(size);
        EXPECT_EQ(inflated(deflated(bytes), size), bytes) << size;
    }
}

}  // namespace
