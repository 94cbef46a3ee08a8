"""Power of each stage: from INA219 logs, or estimated from counted instructions."""
