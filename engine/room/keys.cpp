#include "engine/room/keys.h"

#include <algorithm>
#include <fmt/format.h>
#include <map>
#include <toml++/toml.h>

#include "engine/io/files.h"
#include "engine/io/text.h"
#include "engine/io/toml_section.h"
#include "engine/script/command.h"
#include "physics/geometry/vec.h"
#include "render/xray/materials.h"

namespace room {
namespace {

using geometry::degree;

io::Range positive(double most) {
    return {1e-3, most};
}

class Reader {
public:
    Reader(io::ParseContext& reading, KeyMap map) : reading_(reading), map_(std::move(map)) {}

    KeyMap read(const toml::table& file) {
        io::Section top(reading_, &file, "");
        if (top.find("schema")) top.schema();  // files of earlier versions have none
        hand(top.section("hand", false));
        stand(top.section("stand", false));
        keys(top.section("keys", false));
        injections(top);
        top.finish();
        return std::move(map_);
    }

private:
    void three(io::Section& section, std::string_view key, std::array<double, 3>& values, double most,
               double unit = 1) {
        const toml::node* node = section.find(key);
        if (!node) return;
        const std::string accepted =
            fmt::format("three numbers, fine, plain and fast, rising from above 0 to {} at most", most);
        const toml::array* array = node->as_array();
        std::array<double, 3> read{};
        bool good = array && array->size() == 3;
        for (std::size_t k = 0; good && k < 3; ++k) {
            const std::optional<double> value = (*array)[k].value<double>();
            good = value && *value > (k == 0 ? 0 : read[k - 1]) && *value <= most;
            if (good) read[k] = *value;
        }
        if (!good) return section.refuse(key, *node, accepted);
        for (std::size_t k = 0; k < 3; ++k) values[k] = read[k] * unit;
    }

    void hand(io::Section section) {
        Speeds& s = map_.speeds;
        three(section, "advance_mm_per_s", s.advance, 200);
        three(section, "rotate_deg_per_s", s.rotate, 3600, degree);
        three(section, "shift_px", s.shift, 50);
        section.number("grip_step_mm", s.grip_step, positive(100));
        section.number("run_up_s", s.run_up, {0, 5});
        section.number("wheel_mm", s.wheel, positive(50));
        section.number("drag_mm_per_pixel", s.drag_advance, positive(5));
        section.number("drag_deg_per_pixel", s.drag_rotate, positive(45), degree);
        section.number("gamepad_dead_zone", s.dead_zone, {0, 0.9});
        if (const auto side = section.choice("mouse", side_names)) map_.mouse = static_cast<Side>(*side);
        section.finish();
    }

    void stand(io::Section section) {
        Speeds& s = map_.speeds;
        section.number("arm_deg_per_s", s.arm, positive(60), degree);
        section.number("table_mm_per_s", s.table, positive(300));
        section.number("sid_step_mm", s.sid_step, positive(300));
        if (const toml::node* node = section.find("fields_mm")) {
            const toml::array* array = node->as_array();
            std::vector<double> fields;
            bool good = array && !array->empty();
            if (good)
                for (const toml::node& item : *array) {
                    const std::optional<double> value = item.value<double>();
                    good = good && value && *value >= 50 && *value <= 600;
                    if (value) fields.push_back(*value);
                }
            good = good && std::is_sorted(fields.rbegin(), fields.rend());
            if (good)
                s.fields = fields;
            else
                section.refuse("fields_mm", *node, "a list of widths from 50 to 600 mm, widest first");
        }
        section.finish();
    }

    /// Marks the key as taken and returns it; empty where it is unknown or already taken.
    std::optional<Key> claim(const toml::node& node, const std::string& by) {
        const std::optional<std::string> name = node.value<std::string>();
        const std::optional<Key> key = name ? find_key(*name) : std::nullopt;
        if (!key) {
            std::vector<std::string_view> words;  // a single letter is near to any word
            for (const std::string_view known : key_names())
                if (known.size() > 1) words.push_back(known);
            reading_.refuse(
                node.source(),
                fmt::format(
                    "{} is no key{}; expected letters, digits, F1 to F12, Up, Space, LeftShift, Keypad0, "
                    "GamepadA, ...",
                    name ? "'" + *name + "'" : "this", name ? io::suggestion(*name, words) : ""));
            return std::nullopt;
        }
        if (const auto [known, is_new] = claimed_.emplace(*key, by); !is_new) {
            reading_.refuse(node.source(),
                            fmt::format("'{}' is given to '{}' already; expected a key that is free", *name,
                                        known->second));
            return std::nullopt;
        }
        return key;
    }

    void keys(io::Section section) {
        std::array<bool, actions> named{};
        for (int k = 0; k < actions; ++k) {
            const std::string_view name = info(static_cast<Action>(k)).key;
            const toml::node* node = section.find(name);
            if (!node) continue;
            named[k] = true;
            map_.keys[k].clear();
            const std::string by(name);
            if (const toml::array* array = node->as_array()) {
                for (const toml::node& item : *array)
                    if (const auto key = claim(item, by)) map_.keys[k].push_back(*key);
            } else if (const auto key = claim(*node, by)) {
                map_.keys[k].push_back(*key);
            }
        }
        section.finish();
        for (int k = 0; k < actions; ++k)
            if (!named[k]) std::erase_if(map_.keys[k], [&](Key key) { return claimed_.contains(key); });
    }

    void injections(io::Section& top) {
        std::vector<io::Section> given = top.sections("injection");
        if (!given.empty()) map_.injections.clear();
        for (io::Section& section : given) {
            InjectionPreset preset = injection(section);
            for (std::vector<Key>& keys : map_.keys) std::erase(keys, preset.key);
            map_.injections.push_back(std::move(preset));
        }
        std::erase_if(map_.injections, [&](const InjectionPreset& preset) {
            const auto found = claimed_.find(preset.key);
            return found != claimed_.end() && found->second != "an injection";
        });
    }

    InjectionPreset injection(io::Section& section) {
        InjectionPreset preset;
        if (const toml::node* node = section.find("key")) {
            if (const auto key = claim(*node, "an injection")) preset.key = *key;
        } else {
            section.missing("key", "the key that starts it");
        }
        section.word("name", preset.name);
        std::string into = "aorta";
        section.word("into", into);
        preset.site = into == "device"       ? InjectionPreset::Site::Device
                      : into == "introducer" ? InjectionPreset::Site::Introducer
                                             : InjectionPreset::Site::Branch;
        if (preset.site == InjectionPreset::Site::Branch) {
            preset.branch = into;
            preset.by = InjectionPreset::By::Pump;
        }
        constexpr std::array<std::string_view, 2> givers = {"hand", "pump"};
        if (const auto by = section.choice("by", givers)) preset.by = static_cast<InjectionPreset::By>(*by);
        const bool hand = preset.by == InjectionPreset::By::Hand;
        section.number("volume_ml", preset.volume,
                       positive(hand ? largest_hand_volume : largest_pump_volume));
        section.number("rate_ml_per_s", preset.rate,
                       positive(hand ? largest_hand_rate : render::largest_flow));
        section.number("iodine_mg_per_ml", preset.iodine, {1, render::largest_iodine});
        section.finish();
        return preset;
    }

    io::ParseContext& reading_;
    KeyMap map_;
    std::map<Key, std::string> claimed_;
};

}  // namespace

const std::vector<std::string_view>& key_names() {
    static const std::vector<std::string_view> names = io::words_of(
        "Space Apostrophe Comma Minus Period Slash 0 1 2 3 4 5 6 7 8 9 Semicolon Equal "
        "A B C D E F G H I J K L M N O P Q R S T U V W X Y Z "
        "LeftBracket Backslash RightBracket GraveAccent "
        "Escape Enter Tab Backspace Insert Delete Right Left Down Up PageUp PageDown Home End "
        "CapsLock F1 F2 F3 F4 F5 F6 F7 F8 F9 F10 F11 F12 "
        "Keypad0 Keypad1 Keypad2 Keypad3 Keypad4 Keypad5 Keypad6 Keypad7 Keypad8 Keypad9 "
        "KeypadDecimal KeypadDivide KeypadMultiply KeypadSubtract KeypadAdd KeypadEnter "
        "LeftShift LeftControl LeftAlt RightShift RightControl RightAlt "
        "GamepadA GamepadB GamepadX GamepadY GamepadLeftBumper GamepadRightBumper GamepadBack GamepadStart "
        "GamepadUp GamepadRight GamepadDown GamepadLeft GamepadLeftStick GamepadRightStick");
    return names;
}

std::optional<Key> find_key(std::string_view name) {
    const auto& names = key_names();
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) return std::nullopt;
    return static_cast<Key>(found - names.begin());
}

std::string label_of(std::string_view name, std::string_view in_layout) {
    const bool others_have_it = name.starts_with("Keypad") || name == "Space";
    if (others_have_it || in_layout.empty() || !io::is_utf8(in_layout)) return std::string(name);
    // Signs that are hardly seen alone.
    constexpr std::pair<std::string_view, std::string_view> small[] = {
        {".", "Period"}, {",", "Comma"}, {"'", "Apostrophe"}, {"`", "GraveAccent"}, {"-", "Minus"}};
    for (const auto& [sign, word] : small)
        if (in_layout == sign) return std::string(word);
    for (const char c : in_layout) {
        const auto byte = static_cast<unsigned char>(c);
        // Leading bytes of U+0080 to U+017F and of U+0380 to U+03FF; what continues them is below 0xC0.
        const bool shown = byte > 0x20 && byte != 0x7F && (byte < 0xC6 || byte == 0xCE || byte == 0xCF);
        if (!shown) return std::string(name);
    }
    std::string label(in_layout);
    for (char& c : label)
        if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
    return label;
}

std::string sentence_of(const InjectionPreset& preset) {
    return fmt::format("{}{}{}: {:g} ml at {:g} ml/s", preset.name, preset.name.empty() ? "" : ", ",
                       preset.by == InjectionPreset::By::Hand ? "by hand" : "pump", preset.volume,
                       preset.rate);
}

std::string KeyMap::label(Key key) const {
    const auto at = static_cast<std::size_t>(key);
    return at < labels.size() ? labels[at] : std::string(key_names().at(at));
}

std::string KeyMap::text(Action action) const {
    std::vector<std::string> names;
    for (const Key key : keys[static_cast<int>(action)]) names.push_back(label(key));
    return names.empty() ? "no key" : io::joined(names);
}

std::string KeyMap::first(Action action) const {
    const std::vector<Key>& mine = keys[static_cast<int>(action)];
    return mine.empty() ? "no key" : label(mine.front());
}

KeyMap parse_keys(const std::string& toml, const std::string& file, const KeyMap& base) {
    io::ParseContext reading{file, {}, {}};
    KeyMap map = Reader(reading, base).read(reading.parse(toml));
    reading.end();
    return map;
}

KeyMap load_keys(const std::filesystem::path& path, const KeyMap& base) {
    const std::string text = io::read_text(path, "a file of keys", "expected one (.toml)");
    return parse_keys(text, path.string(), base);
}

}  // namespace room
