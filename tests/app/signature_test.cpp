/// Recordings that are signed: from the teacher's key, as the manual makes it, to the course.

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <nlohmann/json.hpp>
#include <random>

#include "tests/app/pages.h"

namespace app {
namespace {

using test::expect_refused, test::expect_said, test::good_script, test::joined, test::Outcome, test::read,
    test::replaced, test::run, test::s_bend_run, test::Started, test::write;

struct Signed : test::InFolder {
    std::filesystem::path key = folder / "teacher.key", pub = folder / "teacher.pub";

    void tool(const std::vector<std::string>& words) const {
        const Outcome made = Started(folder, joined({"openssl"}, words)).wait();
        ASSERT_EQ(made.code, 0) << made.error;
    }
    void make_keys(const std::filesystem::path& to, const std::filesystem::path& to_pub) const {
        tool({"genpkey", "-algorithm", "ed25519", "-out", to});
        tool({"pkey", "-in", to, "-pubout", "-out", to_pub});
    }
    void SetUp() override {
        if (std::system("command -v openssl >/dev/null") != 0) GTEST_SKIP() << "openssl is not installed";
        make_keys(key, pub);
    }
    /// The signed recording of a run.
    std::string recording(const std::string& out = "out") const {
        const Outcome made =
            run(folder, s_bend_run(folder / out, {"--frames", "none", "--learner", "Ada", "--sign", key}));
        EXPECT_EQ(made.code, 0) << made.error;
        return read(folder / (out + "/run.gw"));
    }
    Outcome course(const std::filesystem::path& by) const {
        return run(folder, {"course", folder / "class", "--key", by, "--json", "--out", folder / "made",
                            "--cache", folder / "cache"});
    }
};

}  // namespace

TEST_F(Signed, FromTheKeyByRunAndReplayToTheCourse) {
    const std::string whole = recording(), file = folder / "out/run.gw";
    const std::size_t line = whole.rfind("\nsignature ed25519 ") + 1;
    ASSERT_EQ(whole.size() - line, 18u + 128 + 1);
    // The signature is OpenSSL's own of all that stands before it.
    write(folder / "content", whole.substr(0, line));
    std::string bytes;
    for (std::size_t at = line + 18; at + 1 < whole.size(); at += 2)
        bytes += static_cast<char>(std::stoi(whole.substr(at, 2), nullptr, 16));
    write(folder / "signature", bytes);
    tool({"pkeyutl", "-verify", "-pubin", "-inkey", pub, "-rawin", "-in", folder / "content", "-sigfile",
          folder / "signature"});
    // Nothing else of the run is another one than without a key.
    succeeded(folder, s_bend_run(folder / "plain", {"--frames", "none", "--learner", "Ada"}));
    EXPECT_EQ(read(folder / "plain/run.gw"), whole.substr(0, line));
    EXPECT_EQ(read(folder / "plain/score.json"), read(folder / "out/score.json"));

    expect_said(succeeded(folder, {"replay", file, "--key", pub}).out, "all equal");
    expect_said(succeeded(folder, {"score", file, "--key", pub}).out, "by Ada");

    make_keys(folder / "other.key", folder / "other.pub");
    std::filesystem::create_directory(folder / "class");
    write(folder / "class/1.gw", whole);
    write(folder / "class/2.gw", whole.substr(0, line));
    write(folder / "class/3.gw", replaced(whole, "learner Ada", "learner Eva"));
    const auto attempts = nlohmann::json::parse(course(pub).out)["attempts"];
    ASSERT_EQ(attempts.size(), 3u);
    std::map<std::string, std::string> problems;
    for (const auto& attempt : attempts)
        problems[attempt["learner"].get<std::string>() +
                 (attempt["problem"].is_null() ? "" : ": " + attempt["problem"].get<std::string>())];
    EXPECT_TRUE(problems.contains("Ada") || problems.contains("Ada: ")) << attempts;
    EXPECT_TRUE(problems.contains("Ada: it has no signature")) << attempts;
    EXPECT_TRUE(
        problems.contains("Eva: its signature does not fit: it was changed after it was signed, or "
                          "signed with another key"))
        << attempts;
    // By another key none counts, though the first look has left figures in the cache.
    expect_said(run(folder, {"course", folder / "class", "--key", folder / "other.pub", "--out",
                             folder / "made", "--cache", folder / "cache"})
                    .out,
                "3 recordings, 0 attempts, 3 files that do not count");

    for (const char* const command : {"replay", "score"}) {
        const Outcome other = run(folder, {command, file, "--key", folder / "other.pub"}),
                      none = run(folder, {command, folder / "class/2.gw", "--key", pub});
        EXPECT_EQ(other.code, 3);
        EXPECT_EQ(other.out + other.error,
                  file +
                      " does not count: its signature does not fit: it was changed after it was signed, or "
                      "signed with another key\n");
        EXPECT_EQ(none.code, 3);
        EXPECT_EQ(none.out + none.error,
                  (folder / "class/2.gw").string() + " does not count: it has no signature\n");
    }
}

TEST_F(Signed, AThousandRecordingsOfWhichOneByteIsAnotherAreNeverAccepted) {
    const std::string whole = recording();
    const unsigned seed = std::random_device()();
    SCOPED_TRACE(fmt::format("seed {}", seed));
    std::mt19937 random(seed);
    std::filesystem::create_directory(folder / "class");
    constexpr int count = 1000;
    for (int k = 0; k < count; ++k) {
        std::string changed = whole;
        const std::size_t at = std::uniform_int_distribution<std::size_t>(0, whole.size() - 1)(random);
        const auto other = static_cast<char>(std::uniform_int_distribution<int>(1, 255)(random));
        switch (k % 8) {
            case 0:
                changed.insert(at, 1, other);
                break;
            case 1:
                changed.erase(at, 1);
                break;
            case 2:  // within the signature, also to the same digit in upper case
                changed[whole.size() - 1 - at % 146] ^= k % 16 == 2 ? 0x20 : other;
                break;
            default:
                changed[at] ^= other;
        }
        write(folder / fmt::format("class/{:04}.gw", k), changed == whole ? whole + " " : changed);
    }
    const Outcome replayed = run(folder, {"replay", folder / "class", "--key", pub});
    EXPECT_EQ(replayed.code, 3);
    EXPECT_EQ(replayed.out, "");
    EXPECT_EQ(std::count(replayed.error.begin(), replayed.error.end(), '\n'), count);
    std::size_t refused = 0;
    for (std::size_t at = 0; (at = replayed.error.find(" does not count: it", at)) != std::string::npos; ++at)
        ++refused;
    EXPECT_EQ(refused, std::size_t{count});
    const auto attempts = nlohmann::json::parse(course(pub).out)["attempts"];
    EXPECT_EQ(attempts.size(), std::size_t{count});
    for (const auto& attempt : attempts)
        EXPECT_TRUE(attempt["problem"].is_string() && attempt["problem"] != "") << attempt;
}

TEST_F(Signed, KeysThatCannotSignOrCheckAreRefusedInOneSentenceBeforeAnythingIsPlayed) {
    const std::string whole = recording();
    tool({"genpkey", "-algorithm", "ed25519", "-aes256", "-pass", "pass:x", "-out", folder / "locked.key"});
    tool({"genpkey", "-algorithm", "x25519", "-out", folder / "x.key"});
    tool({"pkey", "-in", folder / "x.key", "-pubout", "-out", folder / "x.pub"});
    tool({"genpkey", "-algorithm", "rsa", "-pkeyopt", "rsa_keygen_bits:1024", "-out", folder / "rsa.key"});
    write(folder / "none.key", "-----BEGIN PRIVATE KEY-----\nabc\n-----END PRIVATE KEY-----\n");
    write(folder / "empty.key", "");
    write(folder / "large.key", std::string(100000, 'x'));
    const auto says = [&](const std::vector<std::string>& words, const std::string& expected) {
        const Outcome refused = run(folder, words);
        expect_refused(refused, expected);
        EXPECT_EQ(std::count(refused.error.begin(), refused.error.end(), '\n'), 1) << refused.error;
    };
    const std::map<std::string, std::string> private_ones = {
        {"teacher.pub", "found a public key"},
        {"locked.key", "the key is encrypted; expected one without a password"},
        {"x.key", "found one of another algorithm (X25519)"},
        {"rsa.key", "found one of another algorithm (rsaEncryption)"},
        {"none.key", "found none"},
        {"empty.key", "found none"},
        {"large.key", "found a file of 100000 bytes"},
        {"absent.key", "no such key can be read"}};
    for (const auto& [name, said] : private_ones) {
        says(s_bend_run(folder / "not", {"--sign", folder / name}), said);
        EXPECT_FALSE(std::filesystem::exists(folder / "not"));
        if (name != "teacher.pub") says({"play", "--sign", folder / name}, said);
    }
    const std::map<std::string, std::string> public_ones = {{"teacher.key", "found a private key"},
                                                            {"x.pub", "of another algorithm (X25519)"},
                                                            {"empty.key", "found none"},
                                                            {"absent.pub", "no such key can be read"}};
    for (const auto& [name, said] : public_ones) {
        says({"replay", folder / "out/run.gw", "--key", folder / name}, said);
        says({"score", folder / "out/run.gw", "--key", folder / name}, said);
        says({"course", folder / "out", "--key", folder / name}, said);
    }
    // A key is no place for an output.
    std::filesystem::create_directory(folder / "keys");
    std::filesystem::copy_file(key, folder / "keys/run.gw");
    expect_refused(run(folder, s_bend_run(folder / "keys", {"--sign", folder / "keys/run.gw"})), "run.gw");
    EXPECT_EQ(read(folder / "keys/run.gw"), read(key));
}

TEST_F(Signed, NothingFollowsASignatureAndARecordingIsSignedOnce) {
    const std::string whole = recording();
    write(folder / "more.gw", whole + "comment 3 Well done\n");
    expect_refused(run(folder, {"replay", folder / "more.gw"}), "expected nothing after it");
    const Outcome checked = run(folder, {"replay", folder / "more.gw", "--key", pub});
    EXPECT_EQ(checked.code, 3);
    expect_said(checked.error, "its signature is damaged, or something was added after it");
    // What is made of a signed recording is a recording of its own, and has a signature of its own.
    const Outcome again =
        run(folder, s_bend_run(folder / "again", {"--frames", "none", "--sign", key}, folder / "out/run.gw"));
    ASSERT_EQ(again.code, 0) << again.error;
    EXPECT_EQ(run(folder, {"replay", folder / "again/run.gw", "--key", pub}).code, 0);
}

}  // namespace app
