#include "tests/process.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
