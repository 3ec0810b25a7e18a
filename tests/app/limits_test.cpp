/// What the program does where a system gives it less: memory, threads, /proc; and what it bounds itself.

#include <random>
#include <sstream>

#include "tests/app/program.h"

namespace app {
namespace {

using test::command, test::joined, test::Outcome, test::read, test::s_bend_run, test::Started,
    test::TemporaryFolder;

/// Runs the program after `prelude` of bash, as "ulimit -v 400000".
Outcome run_after(const std::string& prelude, const TemporaryFolder& folder,
                  const std::vector<std::string>& words) {
    return Started(folder, joined({"bash", "-c", prelude + "; exec \"$0\" \"$@\""}, command(words))).wait();
}

/// Ends in a code of its own; a refusal is a sentence. The loader's own refusals are not this program's.
void expect_no_signal(const Outcome& result, const std::string& what) {
    if (result.code == 127) return test::expect_said(result.error, "error while loading shared libraries");
    EXPECT_LT(result.code, 4) << what << "\n" << result.error;
    if (result.code == 2) test::expect_said(result.error, "seldinger: ");
}

std::string repeated(const std::string& line, int count) {
    std::string text;
    for (int k = 0; k < count; ++k) text += line;
    return text;
}

/// What serve says of these lines.
Outcome served(const TemporaryFolder& folder, const std::string& lines) {
    test::write(folder / "lines.txt", lines);
    return run_after("exec <lines.txt", folder, {"serve", "s_bend", "--cache", folder / "cache"});
}

}  // namespace

TEST(Limits, OfMemoryAreToldInASentenceByRunsWithImages) {
    const TemporaryFolder folder;
    ASSERT_LT(test::run(folder, s_bend_run(folder / "whole", {"--cache", folder / "cache"})).code, 2);
    const unsigned seed = std::random_device()();
    std::mt19937 draw(seed);
    std::uniform_int_distribution<int> megabytes(250, 700);
    int refused = 0, told_of_images = 0;
    for (int k = 0; k < 40; ++k) {
        // Where the rasteriser begins, and anywhere.
        const int limit = k < 20 ? 280 + 8 * k : megabytes(draw);
        const std::string what = std::to_string(limit) + " MB, seed " + std::to_string(seed);
        const Outcome result =
            run_after("ulimit -v " + std::to_string(limit * 1000), folder,
                      s_bend_run(folder / std::to_string(k), {"--cache", folder / "cache"}));
        expect_no_signal(result, what);
        refused += result.code == 2;
        told_of_images += result.error.find("images: expected") != std::string::npos;
    }
    EXPECT_GT(refused, 0);
    EXPECT_GT(told_of_images, 0);
}

TEST(Limits, OfProcessesAreToldInASentence) {
    const TemporaryFolder folder;
    // The superuser has no such limit, so that another user runs it.
    std::filesystem::permissions(folder.path(), std::filesystem::perms::all);
    const Outcome other =
        Started(folder, {"setpriv", "--reuid=65534", "--clear-groups", SELDINGER_PROGRAM, "--version"})
            .wait();
    if (other.code != 0) GTEST_SKIP() << "no other user can be taken: " << other.error;
    for (int threads = 1; threads < 8; ++threads) {
        const Outcome result =
            Started(folder, joined({"setpriv", "--reuid=65534", "--clear-groups", "bash", "-c",
                                    "ulimit -u " + std::to_string(threads) + "; exec \"$0\" \"$@\""},
                                   command(s_bend_run(folder / std::to_string(threads)))))
                .wait();
        expect_no_signal(result, std::to_string(threads) + " threads");
        if (threads == 1) test::expect_said(result.error, "found no room for it within the limits");
    }
}

TEST(Limits, WithoutProcARunHasTheStatesThatItHasElsewhere) {
    const TemporaryFolder folder;
    const std::string without = "umount -l /proc 2>/dev/null || exit 99; [ ! -e /proc/self ] || exit 99";
    const auto words = [&](const std::string& out) {
        return joined(command(s_bend_run(folder / out, {"--cache", folder / "cache"})), {});
    };
    const Outcome usual = Started(folder, words("usual")).wait();
    const Outcome result =
        Started(folder, joined({"unshare", "--mount", "bash", "-c", without + "; exec \"$0\" \"$@\""},
                               words("without")))
            .wait();
    if (result.code == 99 || result.error.find("unshare") != std::string::npos)
        GTEST_SKIP() << "/proc cannot be taken away here: " << result.error;
    EXPECT_EQ(result.code, usual.code) << result.error;
    EXPECT_EQ(read(folder / "without/run.gw"), read(folder / "usual/run.gw"));
}

TEST(Limits, ServeKeepsAHundredThousandCommandsForAStepAndRefusesMore) {
    const TemporaryFolder folder;
    const Outcome result =
        served(folder, repeated("advance 0.00001 mm\narm lao 1 deg cranial 0 deg\n", 50'001) +
                           "state\nstep\nadvance 1 mm\nstep\n");
    EXPECT_EQ(result.code, 0) << result.error;
    test::expect_said(result.out, "expected at most 100000 commands before a step, found one more");
    std::istringstream lines(result.out);
    int states = 0, errors = 0;
    for (std::string line; std::getline(lines, line);) ++(line.starts_with("{\"error\"") ? errors : states);
    EXPECT_EQ(errors, 2);
    EXPECT_EQ(states, 4);
}

TEST(Limits, ServeRefusesALineOfMoreThanAMegabyteAndGoesOn) {
    const TemporaryFolder folder;
    const Outcome result = served(folder, std::string(3'000'000, 'x') + "\nstep\n");
    EXPECT_EQ(result.code, 0) << result.error;
    test::expect_said(result.out, "expected a line of at most 1000000 bytes, found a longer one");
    EXPECT_NE(result.out.find("\"frame\":0"), std::string::npos);
}

}  // namespace app
