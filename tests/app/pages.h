#pragma once
/// Recordings of a class, and a browser.

#include <filesystem>
#include <string>
#include <vector>

#include "tests/app/program.h"

namespace test {

inline const char* const clumsy =
    "1 advance 4 mm\n4 beam on\n5..20 advance 4 mm\n21..24 withdraw 4 mm\n25 rotate 40 deg\n26..60 advance 4 "
    "mm\n"
    "130 end\n";

/// A recording of the script at s_bend.
inline std::filesystem::path recorded(const TemporaryFolder& folder, const std::string& name,
                                      const std::string& script, const std::string& learner = "Ada") {
    write(folder / (name + ".script.gw"), script);
    run(folder, s_bend_run(folder / name, {"--frames", "none", "--learner", learner},
                           folder / (name + ".script.gw")));
    std::filesystem::copy_file(folder / name / "run.gw", folder / (name + ".gw"));
    return folder / (name + ".gw");
}

/// Puts a recording into the folder of a class.
inline void put(const TemporaryFolder& folder, const std::string& file, const std::string& to) {
    std::filesystem::copy_file(file, folder / ("class/" + to));
}

inline const char* const chromium = "/usr/bin/chromium";

/// What headless Chromium makes of a page.
inline Outcome browse(const TemporaryFolder& folder, std::vector<std::string> words) {
    words.insert(words.begin(),
                 {chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
                  "--enable-logging=stderr", "--virtual-time-budget=5000",
                  "--user-data-dir=" + (folder / "profile").string()});
    return Started(folder, words).wait();
}

}  // namespace test
