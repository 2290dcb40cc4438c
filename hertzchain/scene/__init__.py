"""What is simulated: chain, pulse, run, and the steps that every engine cuts the run into."""
