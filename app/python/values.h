#pragma once
/// What passes between Python and the engine: arrays, states, devices, places and targets.

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fmt/format.h>
#include <optional>
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "engine/episode/episode.h"
#include "engine/io/error.h"
#include "physics/geometry/vec.h"

namespace py = pybind11;

namespace app {

using episode::Episode;
using exercise::Observation;
using geometry::Vec3;
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;
using Flags = py::array_t<bool, py::array::c_style | py::array::forcecast>;

/// What was given as an Array (py::array, Doubles); empty where it can't be one. Making it may run the
/// caller's code (__array__, __float__, a handler of signals): an exception of that is the caller's, Ctrl-C
/// among them, where Array::ensure() would drop it.
template <class Array>
Array array_given(py::handle given) {
    try {
        return Array(py::reinterpret_borrow<py::object>(given));
    } catch (const py::error_already_set& error) {
        for (PyObject* unfit : {PyExc_TypeError, PyExc_ValueError, PyExc_OverflowError})
            if (error.matches(unfit)) return py::reinterpret_steal<Array>(py::handle());
        throw;
    }
}

}  // namespace app

template <>
struct pybind11::detail::pyobject_caster<app::Doubles> {
    PYBIND11_TYPE_CASTER(app::Doubles, handle_type_name<app::Doubles>::name);

    bool load(handle given, bool convert) {
        if (!convert && !app::Doubles::check_(given)) return false;
        value = app::array_given<app::Doubles>(given);
        return static_cast<bool>(value);
    }
    static handle cast(const handle& array, return_value_policy, handle) { return array.inc_ref(); }
};

namespace app {

inline constexpr double largest_motion = script::largest_motion;      // [mm]
inline constexpr double largest_rotation = script::largest_rotation;  // [deg]
inline constexpr double largest_place = 1e4;  // [mm], that of a scenario's coordinates

inline std::string text_of(double value) {
    return py::str(py::float_(value));
}

/// A motion as a script would accept it.
inline double checked(double value, double most, const char* what, const char* unit) {
    if (!(std::abs(value) <= most))
        throw io::InputError("{0}: {1} {2} was given; expected -{3} to {3}", what, text_of(value), unit,
                             text_of(most));
    return value;
}

/// Asks Python for Ctrl-C; to be called with the interpreter locked.
inline void check_signals() {
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
}

inline py::array_t<double> array_of(const Vec3& v) {
    return py::array_t<double>(3, v.data());
}

/// Rows of so many numbers; one number a row has one dimension.
inline py::array_t<double> array_of(const std::vector<double>& numbers, int columns) {
    const auto size = static_cast<py::ssize_t>(numbers.size());
    if (columns == 1) return py::array_t<double>(size, numbers.data());
    return py::array_t<double>({size / columns, py::ssize_t{columns}}, numbers.data());
}

inline py::array_t<double> array_of(const geometry::Polyline& line) {
    static_assert(sizeof(Vec3) == 3 * sizeof(double));
    return py::array_t<double>({static_cast<py::ssize_t>(line.size()), py::ssize_t{3}},
                               line.empty() ? nullptr : line.front().data());
}

inline py::array_t<std::uint8_t> array_of(const render::GrayImage& image) {
    py::array_t<std::uint8_t> a({image.height, image.width});
    std::copy(image.pixels.begin(), image.pixels.end(), a.mutable_data());
    return a;
}
inline py::array_t<std::uint8_t> array_of(const render::ColourImage& image) {
    py::array_t<std::uint8_t> a({image.height, image.width, 3});
    std::copy(image.pixels.begin(), image.pixels.end(), a.mutable_data());
    return a;
}

/// The devices that a scenario has, innermost first.
using Roles = std::vector<script::DeviceRole>;
inline Roles roles_of(const exercise::Simulation& simulation) {
    Roles roles;
    for (const scenario::PlacedDevice& placed : simulation.devices()) roles.push_back(placed.role);
    return roles;
}

struct State {
    Observation reading;
    std::string branch;
    std::uint64_t hash = 0;
    Roles roles;
    std::vector<py::array_t<double>> lists;  // as list_fields()
};

/// What a State is made from, without objects of Python.
struct Read {
    Observation reading;
    std::string branch;
    std::uint64_t hash = 0;
    Roles roles;
    std::vector<std::vector<double>> lists;
};
inline Read read(const Episode& episode) {
    const exercise::Simulation& simulation = episode.simulation();
    Read s{episode.full_reading(), {}, episode.hash(), roles_of(simulation), {}};
    s.branch = name_of(s.reading.branch, simulation.anatomy());
    const render::CArm arm = episode.arm(simulation.scenario().c_arm.pixels);
    for (const episode::ListField& field : episode::list_fields()) s.lists.push_back(field.of(episode, arm));
    return s;
}
inline State state_of(Read&& read) {
    State s{read.reading, std::move(read.branch), read.hash, std::move(read.roles), {}};
    for (std::size_t k = 0; k < read.lists.size(); ++k)
        s.lists.push_back(array_of(read.lists[k], episode::list_fields()[k].columns));
    return s;
}

/// A field's value as an attribute of State.
struct AsAttribute {
    const State& state;
    py::object operator()(std::int64_t value) const { return py::int_(value); }
    py::object operator()(double value) const { return py::float_(value); }
    py::object operator()(bool value) const { return py::bool_(value); }
    py::object operator()(const exercise::Place& place) const { return py::array_t<double>(3, place.data()); }
    py::object operator()(const exercise::InImage& place) const { return py::array_t<double>(2, &place.x); }
    py::object operator()(const exercise::OfDevices& value) const { return py::float_(value.of[0]); }
    py::object operator()(exercise::Branch) const { return py::str(state.branch); }
    py::object operator()(script::DeviceRole held) const {
        return py::str(std::string(script::name_of(held)));
    }
};

/// What a field is: as an attribute of State, and in a record of NumPy.
struct Kind {
    const char* attribute;
    const char* format;
    int size;      // of the record's array; 1 = a number
    bool devices;  // one number of each device

    Kind(std::int64_t Observation::*) : Kind("int", "i8", 1) {}
    Kind(double Observation::*) : Kind("float", "f8", 1) {}
    Kind(bool Observation::*) : Kind("bool", "?", 1) {}
    Kind(exercise::Place Observation::*) : Kind("(3,) float64", "f8", 3) {}
    Kind(exercise::InImage Observation::*) : Kind("(2,) float64", "f8", 2) {}
    Kind(exercise::OfDevices Observation::*) : Kind("float", "f8", script::most_devices, true) {}
    Kind(exercise::Branch Observation::*) : Kind("str", "i8", 1) {}
    Kind(script::DeviceRole Observation::*) : Kind("str", "i4", 1) {}

private:
    Kind(const char* as_attribute, const char* in_record, int in_all, bool of_devices = false)
        : attribute(as_attribute), format(in_record), size(in_all), devices(of_devices) {}
};
inline Kind kind_of(const exercise::Field& field) {
    return std::visit([](const auto member) { return Kind(member); }, field.member);
}

/// A Observation as a record of NumPy.
inline py::dtype record() {
    static const Observation of;
    py::list names, formats, offsets;
    for (const exercise::Field& field : exercise::fields()) {
        if (field.name.empty()) continue;
        const Kind kind = kind_of(field);
        names.append(std::string(field.name));
        formats.append(kind.size == 1 ? py::object(py::str(kind.format))
                                      : py::object(py::make_tuple(kind.format, py::make_tuple(kind.size))));
        offsets.append(std::visit(
            [](const auto member) {
                return reinterpret_cast<const char*>(&(of.*member)) - reinterpret_cast<const char*>(&of);
            },
            field.member));
    }
    return {names, formats, offsets, sizeof(Observation)};
}

inline std::string described(const std::string& type, std::string_view doc, std::string_view unit) {
    return type + ": " + std::string(doc) + (unit.empty() ? "" : " [" + std::string(unit) + "]") + ".";
}

/// As "'wire' (0) and 'catheter' (1)".
inline std::string devices_of(const Roles& devices) {
    std::string text;
    for (std::size_t k = 0; k < devices.size(); ++k) {
        if (k > 0) text += k + 1 < devices.size() ? ", " : " and ";
        text += "'" + std::string(script::name_of(devices[k])) + "' (" + std::to_string(k) + ")";
    }
    return text;
}

/// A device by name, or by its place in the scenario's list.
inline script::DeviceRole held_of(const py::object& device, const Roles& devices) {
    if (py::isinstance<py::str>(device)) {
        if (const auto held = script::role_named(device.cast<std::string>())) return *held;
    } else if (PyIndex_Check(device.ptr()) != 0) {  // whole numbers of Python and of NumPy
        const Py_ssize_t index = PyNumber_AsSsize_t(device.ptr(), nullptr);  // a huge one becomes the largest
        PyErr_Clear();
        if (index >= 0 && index < static_cast<Py_ssize_t>(devices.size()))
            return devices[static_cast<std::size_t>(index)];
    }
    throw io::InputError(
        "device: expected the name or the place of a device, or 'all', found {}; the scenario has {}",
        std::string(py::repr(device)), devices_of(devices));
}

inline episode::ImageMode mode_of(const std::string& mode) {
    for (std::size_t k = 0; k < episode::image_modes.size(); ++k)
        if (episode::image_modes[k] == mode) return static_cast<episode::ImageMode>(k);
    throw io::InputError("mode: '" + mode + "' was given; expected 'live', 'dsa', 'screen' or 'cine'");
}

/// Three coordinates [mm] of what a caller gave; empty where it is not that.
inline std::optional<Vec3> place_of(const py::object& given) {
    const auto any = array_given<py::array>(given);
    if (!any || std::string("iuf").find(any.dtype().kind()) == std::string::npos || any.size() != 3)
        return {};
    const auto numbers = array_given<Doubles>(any);
    if (!numbers) return {};
    const Vec3 place(numbers.data());
    for (const double x : place)
        if (!(std::abs(x) <= largest_place)) return {};  // NaN is none, which Eigen's maxCoeff may pass over
    return place;
}

/// A place [mm], in the words of the argument `what`.
inline Vec3 checked_place(const py::object& given, const char* what) {
    if (const std::optional<Vec3> place = place_of(given)) return *place;
    throw io::InputError("{}: {} was given; expected three finite coordinates in mm, up to 10000 in size",
                         what, std::string(py::repr(given)));
}

/// What a caller asked for in place of a target: the name of one or a place, a radius, or both.
struct Aim {
    Aim(const py::object& target, const std::optional<double>& given) : radius(given) {
        if (py::isinstance<py::str>(target)) {
            name = target.cast<std::string>();
        } else if (!target.is_none()) {
            centre = place_of(target);
            if (!centre)
                throw io::InputError(
                    "target: {} was given; expected the name of a target, or three finite coordinates in mm, "
                    "up to 10000 in size",
                    std::string(py::repr(target)));
        }
        if (radius && !(*radius >= 0.1 && *radius <= 100))
            throw io::InputError("radius_mm: " + text_of(*radius) + " was given; expected 0.1 to 100");
    }
    scenario::Target of(const scenario::Scenario& scenario) const {
        scenario::Target target = scenario.target;
        if (name || centre) {
            target.name = name.value_or("");
            target.centre = centre;
        }
        if (radius) target.radius = *radius;
        return target;
    }
    std::optional<std::string> name;
    std::optional<Vec3> centre;
    std::optional<double> radius;
};

struct Snapshot {
    Episode::Snapshot state;
};

template <class Numbers>
py::bytes bytes_of(const Numbers& numbers) {
    return {reinterpret_cast<const char*>(numbers.data()), numbers.size()};
}
inline py::list texts_of(std::span<const script::Command> commands) {
    py::list texts;
    for (const script::Command& command : commands) texts.append(script::to_text(command));
    return texts;
}
inline std::vector<script::Command> commands_of(const py::handle& texts) {
    std::vector<script::Command> commands;
    for (const py::handle text : texts) commands.push_back(episode::parse_line(text.cast<std::string>()));
    return commands;
}
/// What a pickle begins with: bytes of another version, or of another machine, would be misread.
inline std::string layout() {
    return fmt::format("seldinger {} of {} bytes", SELDINGER_VERSION, sizeof(Observation));
}
inline void require_layout(const py::tuple& parts, std::size_t size) {
    const std::string found = parts.size() == size && py::isinstance<py::str>(parts[0])
                                  ? parts[0].cast<std::string>()
                                  : "something else";
    if (found != layout()) throw io::InputError("pickle: expected one of {}, found {}", layout(), found);
}

/// What a pickle keeps of a snapshot, and back.
inline py::tuple parts_of(const Snapshot& snapshot) {
    const Episode::Snapshot& state = snapshot.state;
    py::list frames;
    for (const episode::Log::Made& frame : state.log.made())
        frames.append(py::make_tuple(texts_of(frame.commands), frame.hash));
    return py::make_tuple(layout(), state.exercise.of, bytes_of(state.exercise.state), frames,
                          texts_of(state.asked), bytes_of(state.room));
}
inline std::vector<std::byte> to_bytes(const py::handle& given) {
    const auto text = given.cast<std::string>();
    const auto* const data = reinterpret_cast<const std::byte*>(text.data());
    return {data, data + text.size()};
}
inline Snapshot snapshot_of(const py::tuple& parts) {
    require_layout(parts, 6);
    Snapshot made;
    made.state.exercise = {parts[1].cast<std::uint64_t>(), to_bytes(parts[2])};
    for (const py::handle frame : parts[3])
        made.state.log.add(commands_of(frame[py::int_(0)]), frame[py::int_(1)].cast<std::uint64_t>());
    made.state.asked = commands_of(parts[4]);
    made.state.room = to_bytes(parts[5]);
    return made;
}

/// The same of a state.
inline py::tuple parts_of(const State& state) {
    std::vector<int> roles;
    for (const script::DeviceRole role : state.roles) roles.push_back(static_cast<int>(role));
    return py::make_tuple(layout(),
                          py::bytes(reinterpret_cast<const char*>(&state.reading), sizeof state.reading),
                          state.branch, state.hash, roles, state.lists);
}
inline State state_of(const py::tuple& parts) {
    require_layout(parts, 6);
    State made;
    const auto reading = parts[1].cast<std::string>();
    const auto roles = parts[4].cast<std::vector<int>>();
    made.lists = parts[5].cast<std::vector<py::array_t<double>>>();
    if (reading.size() != sizeof made.reading || made.lists.size() != episode::list_fields().size() ||
        std::ranges::any_of(roles, [](int role) { return role < 0 || role >= script::most_devices; }))
        throw io::InputError("pickle: expected a state, found something else");
    std::memcpy(&made.reading, reading.data(), sizeof made.reading);
    made.branch = parts[2].cast<std::string>();
    made.hash = parts[3].cast<std::uint64_t>();
    for (const int role : roles) made.roles.push_back(static_cast<script::DeviceRole>(role));
    return made;
}

}  // namespace app
