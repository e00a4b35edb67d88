#pragma once

#include <functional>
#include <string>

#include <gtest/gtest.h>

#include "pulson/core/errors.hpp"

namespace pulson {

/// The message of the InputError that `action` throws, checked to be one line.
inline std::string error_of(const std::function<void()>& action) {
  try {
    action();
  } catch (const InputError& error) {
    std::string message = error.what();
    EXPECT_EQ(message.find_first_of("\r\n"), std::string::npos) << message;
    return message;
  }
  return "no error";
}

}  // namespace pulson
