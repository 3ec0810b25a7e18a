#pragma once
/// What tests of pages share.

#include <regex>
#include <string>
#include <vector>

#include "tests/engine/fixtures.h"

namespace test {

/// Opening tags without their closing ones, and the reverse.
inline std::string unbalanced(const std::string& page) {
    static const std::regex tag("<(/?)([a-z0-9]+)((?:[^<>\"]|\"[^\"]*\")*?)(/?)>");
    std::vector<std::string> open;
    std::string text = page;
    for (const char* raw : {"style", "script"}) {
        const std::regex body("<" + std::string(raw) + "[^>]*>");
        for (std::smatch at; std::regex_search(text, at, body);) {
            const std::size_t begin = static_cast<std::size_t>(at.position()),
                              end = text.find("</" + std::string(raw) + ">", begin);
            if (end == std::string::npos) return "no end of " + std::string(raw);
            text.erase(begin, end + std::string(raw).size() + 3 - begin);
        }
    }
    for (std::sregex_iterator it(text.begin(), text.end(), tag), last; it != last; ++it) {
        const std::string name = (*it)[2];
        if (name == "meta" || name == "img" || (*it)[4] == "/") continue;
        if ((*it)[1] == "") {
            open.push_back(name);
        } else {
            if (open.empty() || open.back() != name)
                return "</" + name + "> closes " + (open.empty() ? "nothing" : open.back());
            open.pop_back();
        }
    }
    return open.empty() ? "" : open.back() + " stays open";
}

}  // namespace test
