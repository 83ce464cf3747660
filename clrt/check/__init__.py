"""What a device answers, against answers that are known: does its driver compile and run the kernels right?"""
