"""A recorded session read back, at its own pace or in the place of a device."""
