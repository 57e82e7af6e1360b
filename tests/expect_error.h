#pragma once

#include <gtest/gtest.h>

#include <string>

namespace anticrack {

/// What the error says that `action` throws; other exceptions escape and fail the test.
template <class Error, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return "(nothing was thrown)";
}

}  // namespace anticrack

/// The statement throws this error, and its message holds the text.
#define EXPECT_ERROR(statement, Error, text) \
  EXPECT_PRED_FORMAT2(testing::IsSubstring, text, anticrack::message_of<Error>([&] { statement; }))
