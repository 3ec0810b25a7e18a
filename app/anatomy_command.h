#pragma once
/// `seldinger anatomy …`: vessels from presets and files.

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "engine/anatomy/generate_run.h"

namespace app {

class AnatomyCommand {
public:
    /// Adds the sub-command; lives as long as it.
    explicit AnatomyCommand(CLI::App&);
    bool given() const { return command_->parsed(); }
    /// Exit code 0; throws engine::InputError.
    int run();

private:
    CLI::App* command_;
    engine::GenerateRequest request_;
    std::vector<std::string> stenoses_, aneurysms_, tortuosities_;
};

}  // namespace app
