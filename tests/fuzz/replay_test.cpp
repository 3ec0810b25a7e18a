/// Every seed and every input that once crashed or hung a reader, and changed copies of them.

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/readers.h"

namespace fuzz {

/// As ctest lists it.
void PrintTo(const Reader& reader, std::ostream* out) {
    *out << reader.name;
}

namespace {

namespace fs = std::filesystem;

/// The files of a folder of tests/fuzz in the order of their names; none where there is no such folder.
std::vector<fs::path> inputs(const std::string& kind, const std::string& reader) {
    std::vector<fs::path> files;
    const fs::path folder = fs::path(SELDINGER_SOURCE) / "tests/fuzz" / kind / reader;
    std::error_code none;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, none))
        files.push_back(entry.path());
    std::sort(files.begin(), files.end());
    return files;
}

std::string bytes_of(const fs::path& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

/// One to eight changes: bytes, numbers, pieces that are lost, doubled or moved, a cut end.
std::string changed(std::string bytes, std::mt19937& random) {
    static const std::array<std::string, 13> words = {
        "-1", "0",        "1e999", "1e308", "-1e20", "nan", "4294967296", "99999999999999999999",
        "\"", "[[[[[[[[", "\n",    "#",     "="};
    const auto below = [&](std::size_t limit) {
        return std::uniform_int_distribution<std::size_t>(0, limit - 1)(random);
    };
    for (std::size_t changes = 1 + below(8); changes > 0; --changes) {
        if (bytes.empty()) return bytes;
        const std::size_t at = below(bytes.size()), length = std::min(1 + below(40), bytes.size() - at);
        switch (below(7)) {
            case 0:
                bytes[at] = static_cast<char>(below(256));
                break;
            case 1:
                bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
                break;
            case 2:
                bytes.erase(at, length);
                break;
            case 3:
                bytes.insert(below(bytes.size()), bytes.substr(at, length));
                break;
            case 4: {
                const std::size_t digit = bytes.find_first_of("0123456789", at);
                if (digit == std::string::npos) break;
                const std::size_t end = std::min(bytes.find_first_not_of("0123456789.", digit), bytes.size());
                bytes.replace(digit, end - digit, words[below(words.size())]);
                break;
            }
            case 5:
                bytes.insert(at, words[below(words.size())]);
                break;
            default:
                if (below(4) == 0) bytes.resize(at);
        }
    }
    return bytes;
}

class EveryReader : public testing::TestWithParam<Reader> {};

TEST_P(EveryReader, HasSeedsOfWhichItTakesSome) {
    int taken = 0;
    for (const fs::path& file : inputs("seeds", GetParam().name)) {
        SCOPED_TRACE(file);
        EXPECT_NO_THROW(taken += accepts(GetParam(), bytes_of(file)));
    }
    EXPECT_GT(taken, 0);
}

TEST_P(EveryReader, RefusesOrTakesWhatOnceBrokeIt) {
    for (const fs::path& file : inputs("found", GetParam().name)) {
        SCOPED_TRACE(file);
        EXPECT_NO_THROW(accepts(GetParam(), bytes_of(file)));
    }
}

TEST_P(EveryReader, RefusesOrTakesChangedSeeds) {
    const char* more = std::getenv("SELDINGER_FUZZ_SEEDS");
    for (const fs::path& file : inputs("seeds", GetParam().name)) {
        // Short texts are read in no time.
        const unsigned usual = file.extension() == ".toml" ? 500 : 60;
        const unsigned count = more ? static_cast<unsigned>(std::atoi(more)) : usual;
        const std::string bytes = bytes_of(file);
        for (unsigned seed = 1; seed <= count; ++seed) {
            SCOPED_TRACE(file.string() + ", seed " + std::to_string(seed));
            std::mt19937 random(seed);
            const std::string other = changed(bytes, random);
            // Left behind where the program is ended.
            const std::string kept = std::string("fuzz-") + GetParam().name + ".bin";
            std::ofstream(kept, std::ios::binary) << other;
            try {
                accepts(GetParam(), other);
            } catch (const std::exception& error) {
                FAIL() << error.what() << "; the input is in " << fs::absolute(kept);
            }
            fs::remove(kept);
        }
    }
}

INSTANTIATE_TEST_SUITE_P(Fuzz, EveryReader, testing::ValuesIn(readers().begin(), readers().end()),
                         [](const auto& of) { return std::string(of.param.name); });

}  // namespace
}  // namespace fuzz
